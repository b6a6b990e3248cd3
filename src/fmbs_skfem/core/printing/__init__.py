"""Kernels as C99, printed for the records of one packed model."""
