"""Solids of tetrahedra and hexahedra: their law, material and body."""
