"""Materials by name: nominal values at room temperature, of which a data sheet knows better.

Sources: EN 1993-1-1:2005, 3.2.6 (structural steel); EN 13906-1:2013 (spring steel wire, E = 206 GPa,
G = 81.5 GPa); EN 1999-1-1:2007, 3.2.5 (aluminium); of the others usual values of data sheets, of
polymers these scatter by a fifth.
"""

from __future__ import annotations

from ..bodies.sections import Material

STEEL = Material(210e9, 7850.0, 0.3)
ALUMINIUM = Material(70e9, 2700.0, 0.3)
KNOWN = {
    "steel": STEEL,
    "S235": STEEL,
    "S355": STEEL,
    "spring_steel": Material(206e9, 7850.0, 0.264),
    "stainless_steel": Material(200e9, 7900.0, 0.3),
    "aluminium": ALUMINIUM,
    "aluminium_6061": ALUMINIUM,
    "titanium": Material(114e9, 4430.0, 0.34),
    "brass": Material(110e9, 8440.0, 0.34),
    "PLA": Material(3.5e9, 1240.0, 0.36),
    "POM": Material(2.8e9, 1410.0, 0.38),
    "ABS": Material(2.3e9, 1050.0, 0.39),
    "PA6": Material(2.9e9, 1130.0, 0.39),
}
