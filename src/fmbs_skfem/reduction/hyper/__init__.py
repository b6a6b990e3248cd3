"""Hyper-reduction: elastic forces at a cost that does not follow the mesh."""

from . import polynomial, sampling  # which register rules  # noqa: F401
