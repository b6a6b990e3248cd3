"""Hyper-reduction: elastic forces at a cost that does not follow the mesh."""
