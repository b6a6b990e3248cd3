"""Bodies and their laws."""

from .body import Body, Cells, cable, point_mass
from .cable_law import Curvature
from .sections import Circular, Given, Material, Rectangular

__all__ = ["Material", "Circular", "Rectangular", "Given", "Curvature", "Cells", "Body", "cable", "point_mass"]
