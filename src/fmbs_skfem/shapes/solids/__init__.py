"""Meshes of tetrahedra and hexahedra: read, checked, tabulated, cut finer."""
