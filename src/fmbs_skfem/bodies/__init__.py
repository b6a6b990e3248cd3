"""Bodies and their laws: cables, plates and shells (`plate.plate`), rigid bodies (`rigid.rigid`),
mass points; stress fields.
"""

from . import own_laws, plate, rigid
from . import stress_recovery as fields
from .beams.drawn_sections import (
    BoxSection,
    CSection,
    Hollow,
    ISection,
    LSection,
    PolygonSection,
    TSection,
    Tube,
    ZSection,
)
from .beams.matrices import Matrices
from .beams.rolled_sections import RolledSection
from .body import Body, Cells, cable, point_mass
from .checks import check_law
from .laws import Law
from .plate import Rim
from .sections import Circular, Given, Material, Rectangular, Section
from .tapered import Tapered

__all__ = [
    "Material",
    "Section",
    "Circular",
    "Rectangular",
    "Given",
    "Tube",
    "ISection",
    "CSection",
    "LSection",
    "TSection",
    "ZSection",
    "BoxSection",
    "Hollow",
    "PolygonSection",
    "RolledSection",
    "Matrices",
    "Tapered",
    "Law",
    "own_laws",
    "Cells",
    "Body",
    "cable",
    "plate",
    "Rim",
    "rigid",
    "point_mass",
    "fields",
    "check_law",
]
