"""Histories become files, plots and pictures; all from plain arrays (`frames`), nothing heavy is
imported before it is used.
"""

from . import frames, pictures, plots, series, speed

__all__ = ["frames", "series", "pictures", "plots", "speed"]
