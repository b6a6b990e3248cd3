"""Reduced bodies that are trained alone and used without mesh and full model, and how well they
stand for their bodies.
"""

from . import finer_parts  # which offers observers  # noqa: F401

__all__ = ["bodies", "excitation", "files"]
