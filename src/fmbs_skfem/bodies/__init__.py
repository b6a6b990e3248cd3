"""Bodies and their laws."""

from .body import Body, Cells, cable, point_mass
from .cable_law import Curvature
from .checks import check_law
from .sections import Circular, Given, Material, Rectangular

__all__ = ["Material", "Circular", "Rectangular", "Given", "Curvature", "Cells", "Body", "cable", "point_mass", "check_law"]
