r"""Planar beams with shear: a centre line r(S) and the director d(S) along it, of which the section's
z axis is Jd, to the left.

    Gamma_1 = d . r',   Gamma_2 = Jd . r',   kappa = Jd . d',   E = d . d,        J = (0, -1; 1, 0)

each less its value in the reference. Of a beam in space that moves in its plane d is d_1, Jd is d_3,
and d_2 points away from the reader: Gamma_2 and kappa are its Gamma_3 and -kappa_2. What its section
would do out of the plane is held.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.errors import InputError, say
from ...core.notices import notify
from ...shapes.table import Floats

FIELDS = 2  #: r and d
#: N, V and M of N, V_y, V_z, T, M_y, M_z
TAKEN = np.zeros((6, 3))
TAKEN[[0, 2, 4], [0, 1, 2]] = 1.0, 1.0, -1.0
SKEW = 1e-6  #: coupling of stiffnesses, over the root of both, that is none
OFF_CENTRE = 1e-9  #: part of its radius of gyration by which a line may miss the centre of mass


def turned(d: Floats) -> Floats:
    """Jd of vectors d (2, ...)."""
    return np.stack([-d[1], d[0]])


def strains(u: Floats) -> Floats:
    """Gamma_1, Gamma_2, kappa and E (4, ...), without those of the reference, of u (4, 2, ...)."""
    _, d, slope, turn = u
    across = turned(d)
    pairs = ((d, slope), (across, slope), (across, turn), (d, d))
    return np.stack([np.asarray((one * other).sum(axis=0)) for one, other in pairs])


def lifted(u: Floats, rates: bool = False) -> Floats:
    """r, d_1, d_2, d_3 and their slopes (8, s, x, 3) of a beam in space, of r, d and their slopes (4,
    s, x, 2), or the `rates` of all.
    """
    found = np.zeros((8, *u.shape[1:-1], 3))
    found[[0, 1, 4, 5], ..., :2] = u
    for k in (1, 5):
        found[k + 2, ..., 0] = -found[k, ..., 1]
        found[k + 2, ..., 1] = found[k, ..., 0]
    if not rates:
        found[2, ..., 2] = -1.0
    return found


def tell_skew(name: str, stiffnesses: Sequence[Floats]) -> None:
    """A notice where a section that bends in the plane would leave it, or twist."""
    for C in stiffnesses:
        size = np.sqrt(np.diag(C))
        own, others = [0, 2, 4], [1, 3, 5]
        if (np.abs(C[np.ix_(own, others)]) > SKEW * np.outer(size[own], size[others])).any():
            return tell_of_plane(name)
    return None


def tell_of_plane(name: str) -> None:
    """The notice of a section that is not symmetric about the plane."""
    notify(
        f"body '{name}': its section is not symmetric about the plane, and is held in it: alone it "
        "would bend sideways or twist, by as much as it bends, with larger stresses; take "
        "dimension: 3 where nothing holds it"
    )


def masses(name: str, given: Sequence[Floats]) -> list[Floats]:
    """Masses (2, 2) of r and d of those of sections, (3, 3) of (1, y, z) or (4, 4) of (1, x, y, z).

    InputError where the line does not pass through the centre of mass: only then do all components
    have one mass.
    """
    found = []
    for one in given:
        along = one[[0, 1]][:, [0, 1]] if len(one) == 4 else np.diag([one[0, 0], 0.0])
        second = one[-1, -1]
        away = abs(one[0, -1]) / one[0, 0]
        if away > OFF_CENTRE * np.sqrt(second / one[0, 0]):
            raise InputError(
                say(
                    f"body '{name}'",
                    "a line through the centres of mass of its sections, in the plane",
                    f"one that is {away:.3g} m from them",
                    "leave out `offset`, or take dimension: 3",
                )
            )
        found.append(along + np.diag([0.0, second]))
    return found
