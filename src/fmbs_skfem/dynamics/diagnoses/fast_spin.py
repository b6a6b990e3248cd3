r"""Bodies of matrices that spin fast beside their lowest frequency: their stiffness is that of rest.

    (omega / omega_1)^2    what a spin adds to the stiffness, or takes of it, over the stiffness

Centrifugal forces stiffen a blade and soften a disc. As its strains are linear, a body of matrices
knows that as far as its axes turn with it, of a blade three quarters. omega_1 is the lowest
frequency of the mechanism at rest in which this body has most of the strain energy.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...core.algebra.linalg import evenly
from ...core.errors import InputError
from ...systems.system import System
from ...systems.terms import corotated
from ...systems.terms.corotated import Corotated
from ..near_state.linear import linearise
from ..near_state.modes import real_modes
from ..observers import judges
from ..tracing import FEW
from ..trajectory import Trajectory

#: (omega / omega_1)^2 from which is warned: a blade that is clamped to its hub bends by 2.4 % too
#: much there, by 1.3 % at half of it, by 4.5 % at twice, and by 14 % at 1
FAST = 0.1
MODES = 20  #: vibrations of the mechanism that are looked through


@judges
def _(motion: Trajectory) -> Iterator[str]:
    """Every body of matrices that spins so fast in one of up to 40 stored states."""
    system = motion.system
    for elastic in system.elastic:
        body = elastic.gather
        if not isinstance(body, Corotated) or body.prestressed:
            continue
        spins = [
            float(np.linalg.norm(spin(system, body, motion.x[k], motion.v[k])))
            for k in evenly(0, len(motion.times) - 1, FEW)
        ]
        fastest = max(spins)
        if not fastest or (lowest := frequency(system, body)) is None:
            continue
        share = (fastest / lowest) ** 2
        if share > FAST:
            text = f"body '{elastic.name}' spins at up to {fastest:.3g} rad/s, and vibrates from {lowest:.3g} rad/s on"
            off = f"the spin changes its stiffness by about {share:.0%}, of which linear strains know a part"
            yield f"{text}: {off}; give the stiffness of its stresses at that spin (`prestress`), or take a beam, a plate or a shell"


def spin(system: System, body: Corotated, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Angular velocity (3,) of a body in a state (n,) with its rates (n,)."""
    z, rates = (
        corotated.coordinates(body, system.lift, one, fixed) for one, fixed in ((x, 1.0), (v, 0.0))
    )
    return corotated.spin(body, z, rates)


def frequency(system: System, body: Corotated) -> float | None:
    """The lowest frequency [rad/s] of a mechanism at rest in which a body has most of the strain
    energy; None where none of the lowest ones is.
    """
    try:
        modes = real_modes(linearise(system), MODES)
    except InputError:
        return None
    for square, shape in zip(modes.squares, modes.shapes.T, strict=True):
        u = corotated.coordinates(body, system.lift, shape, 0.0)
        if square > 0.0 and u @ (body.stiffness @ u) > 0.5 * square:
            return float(np.sqrt(square))
    return None
