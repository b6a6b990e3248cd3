r"""Where bodies of matrices leave the small strains of their stiffness: by their stresses, which change
how they bend, and by large bending.

    V = sum_b x_b (K d)_b^T,    share = |V| / (0.24 w_1^2 J),    J = sum_c X_c^T M X_c                                (1)
    |d|_M / |X|_M    the displacement from the rotated reference, over the radius of gyration                           (2)

V is the virial of the elastic forces, N L of a bar under an axial force N, whatever makes it: loads,
or a spin. A slender bar that is hinged at both ends buckles at N_E = pi^2 E I / L^2, which is 0.24
w_1^2 J / L with the lowest angular frequency w_1 of the free bar, so that (1) is N / N_E: what
stresses add to its stiffness, or take of it. Linear strains know of that what rotates the axes of
the body, three quarters for a blade, nothing for a bar between hinges. What bends draws its ends
together by a square of its deflection, of which a body of matrices knows four fifths.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...core.algebra.linalg import evenly
from ...systems.terms import corotated
from ...systems.terms.corotated import Corotated
from ..observers import judges
from ..tracing import FEW
from ..trajectory import Trajectory

HINGED = 0.24  #: N_E L / w_1^2 J of a slender bar
#: share from which is warned: a bar between hinges bends by 5 % too little or too much there, a blade
#: by 3 % too much; half and twice as much at half and twice of it
STRESSED = 0.05
#: |d| / |X| from which is warned: a cantilever whose end is deflected by 9 % of its length is off
#: there by 1 % of that, by 0.5 % at half and 2 % at twice of it
FAR = 0.017


@judges
def _(motion: Trajectory) -> Iterator[str]:
    """Every body of matrices that is stressed or bent so much in up to 40 stored states."""
    rows = evenly(0, len(motion.times) - 1, FEW)
    for elastic in motion.system.elastic:
        body = elastic.gather
        if not isinstance(body, Corotated):
            continue
        z = [corotated.coordinates(body, motion.system.lift, motion.x[k]) for k in rows]
        found = [corotated.in_axes(body, one) for one in z]
        share = 0.0 if body.prestressed or not body.slowest else stressed(body, found)
        if share > STRESSED:
            text = f"body '{elastic.name}': stresses of loads and of its spin change how it bends, by about {share:.2g} of its stiffness"
            remedy = "give the stiffness of stresses that stay (`prestress`)"
            yield f"{text}, of which linear strains know a part; {remedy}, or take a beam, a plate or a shell"
        farthest = max(distance(body, d) for _, d in found)
        if farthest > FAR:
            text = (
                f"body '{elastic.name}' deforms by up to {farthest:.2g} of its radius of gyration"
            )
            off = f"linear strains are off by about {farthest / FAR:.1g} % of its deflection"
            yield f"{text}: {off}; take several bodies of matrices for it, or a beam, a plate or a shell"


def stressed(body: Corotated, found: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """The largest share (1) of a body in states with x and d (b, c)."""
    largest = 0.0
    for x, d in found:
        V = x.T @ (body.stiffness @ d.ravel()).reshape(-1, 3)
        largest = max(largest, float(np.abs(np.linalg.eigvalsh(0.5 * (V + V.T))).max()))
    return largest / (HINGED * body.slowest**2 * radius_squared(body))


def radius_squared(body: Corotated) -> float:
    """J of (1) [kg m2]."""
    return float(np.sum(body.reference * body.moments))


def distance(body: Corotated, d: np.ndarray) -> float:
    """How far a body is deformed by d (b, c), (2)."""
    return float(np.sqrt(np.sum(d * (body.mass @ d)) / radius_squared(body)))
