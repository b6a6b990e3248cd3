"""Materials by name: nominal values at room temperature, of which a data sheet knows better.

Sources: EN 1993-1-1:2005, 3.2.6 (structural steel); EN 13906-1:2013 (spring steel wire, E = 206 GPa,
G = 81.5 GPa); EN 1999-1-1:2007, 3.2.5 (aluminium); P. B. Lindley, Engineering Design with Natural
Rubber, 5th ed., 1992 (natural rubber of 50 IRHD, E = 2.2 MPa); of the others usual values of data
sheets, of polymers these scatter by a fifth.

Yield strengths, the least of thicknesses up to 16 mm: EN 10025-2 (S235, which `steel` is, and S355),
EN 10089 (51CrV4, quenched and tempered), EN 10088-2 (1.4301, hot rolled), EN 1999-1-1, table 3.2b
(6061-T6), ASTM B265 (Ti-6Al-4V). Those of other aluminium, of brass and of polymers depend on alloy
and temper too much for a number.

Rubber is nearly incompressible, nu = 0.4996 by its bulk modulus; 0.49 keeps cells from locking, and
is right where it can bulge. Its E holds at small strains, up to some 10 %.
"""

from __future__ import annotations

from ..bodies.sections import Material

STEEL = Material(210e9, 7850.0, 0.3, 235e6)
KNOWN = {
    "steel": STEEL,
    "S235": STEEL,
    "S355": Material(210e9, 7850.0, 0.3, 355e6),
    "spring_steel": Material(206e9, 7850.0, 0.264, 1200e6),
    "stainless_steel": Material(200e9, 7900.0, 0.3, 210e6),
    "aluminium": Material(70e9, 2700.0, 0.3),
    "aluminium_6061": Material(70e9, 2700.0, 0.3, 240e6),
    "titanium": Material(114e9, 4430.0, 0.34, 828e6),
    "brass": Material(110e9, 8440.0, 0.34),
    "PLA": Material(3.5e9, 1240.0, 0.36),
    "POM": Material(2.8e9, 1410.0, 0.38),
    "ABS": Material(2.3e9, 1050.0, 0.39),
    "PA6": Material(2.9e9, 1130.0, 0.39),
    "rubber": Material(2.2e6, 1100.0, 0.49),
}
