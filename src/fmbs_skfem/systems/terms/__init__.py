"""Elastic terms f(x) = L^T phi(L x) by their storage, and tangents that turn with bodies."""
