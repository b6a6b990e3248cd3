r"""Thin open sections under torsion at a clamp, which holds their warping in reality and leaves it
free here.

    l = sqrt(E C_w / (G J)),    C_w = int w^2 dA,    twist of a length L, warping held at one end / free = 1 - tanh(L/l) / (L/l)

with the warping w of Saint-Venant's torsion about the shear centre (`Profile.reach`). Sections that
are closed or thick have a C_w that matters nowhere, as angles and plates have, l is about their
width; those of I- and C-sections are as long as beams.

V. Z. Vlasov, Thin-walled Elastic Beams, 2nd ed. 1961; S. P. Timoshenko, J. M. Gere, Theory of
Elastic Stability, 2nd ed., ch. 5.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ...bodies.laws import Law
from ...bodies.stress_recovery import beam_strains
from ...core.algebra.linalg import evenly
from ...systems.measures.beam_sections import matrices
from ...systems.system import Elastic, System
from ...systems.terms import elastic as terms
from ..observers import judges
from ..tracing import FEW
from ..trajectory import Trajectory

OPEN = 0.1  #: J over the polar moment of a section that is thin and open: 0.003 to 0.02 of rolled ones, 0.5 of bars, 1 of tubes
MATTERS = 0.1  #: part of the twist that held warping takes away from which is warned
TWISTED = 0.01  #: twist at a clamp over the largest curvature from which there is torsion
NONE = 1e-9  #: twist of the whole length that is round-off [rad]


class OpenClamp(NamedTuple):
    """A clamp of a beam with a thin open section."""

    joint: str
    place: np.ndarray  #: (3,) [m]
    beam: Elastic
    left: float  #: part of its twist that held warping leaves


def held(system: System) -> Iterator[OpenClamp]:
    """Clamps, and welds to the ground, of full beams whose warping matters."""
    base = system.full or system
    beams = {} if system.components else {one.name: one for one in base.elastic if is_open(one)}
    for joint, kind, rows in base.markers if beams else ():
        if kind not in ("clamp", "weld") or len(rows) != base.dim:
            continue
        read = csr_array(base.sensors.matrix)[list(rows)]
        body = next(
            (
                name
                for name, first, last in base.coordinates
                if first <= min(read.indices, default=-1) < last
            ),
            "",
        )
        swept = next((line.swept for line in base.lines if line.name == body), None)
        if body in beams and swept is not None:
            length = float(beams[body].gather.section[-1].sum())
            ratio = float(swept.profile.reach.max(initial=0.0)) / length
            lost = ratio * float(np.tanh(1.0 / max(ratio, 1e-300)))
            if lost > MATTERS:
                place = read @ base.x0 + base.sensors.offset[list(rows)]
                yield OpenClamp(joint, place, beams[body], 1.0 - lost)


def is_open(elastic: Elastic) -> bool:
    """Whether a beam in full may have a thin open section, by its stiffnesses G J and E I: J is
    small over the polar moment.
    """
    if elastic.gather.law is not Law.BEAM or elastic.gather.section.shape[1] == 1:
        return False
    section = elastic.gather.section
    C = matrices(section[:, 0])
    GJ = 1.0 / np.linalg.inv(C)[:, 3, 3]  # about the shear centre, wherever the line passes
    return bool((OPEN * (C[:, 4, 4] + C[:, 5, 5]) > 2.0 * GJ).any())


@judges
def _(motion: Trajectory) -> Iterator[str]:
    """All open clamps where a beam is twisted, in one of up to 40 stored states."""
    told = []
    base = motion.system.full or motion.system
    for one in held(motion.system):
        start = gradients(one.beam, base, base.x0)
        cell = int(np.linalg.norm(start[:3].mean(axis=1).T - one.place, axis=1).argmin())
        twist = bent = 0.0
        for k in evenly(0, len(motion.times) - 1, FEW):
            kappa = beam_strains(
                gradients(one.beam, base, motion.system.lift(motion.x[k])), one.beam.gather.section
            )[3:]
            twist, bent = (
                max(twist, abs(float(kappa[0, :, cell].mean()))),
                max(bent, float(np.abs(kappa[1:]).max())),
            )
        if twist > max(TWISTED * bent, NONE / float(one.beam.gather.section[-1].sum())):
            shown = ", ".join(f"{x:.4g}" for x in one.place + base.origin + 0.0)
            told.append(
                f"'{one.beam.name}' at joint '{one.joint}', ({shown}) m, {one.left:.2g} of the twist"
            )
    if told:
        text = "warping is free, also where thin open sections are clamped under torsion; a support that holds it leaves"
        yield f"{text}: {'; '.join(told)}; write `warping: true` in the beam where supports do so"


def gradients(beam: Elastic, base: System, q: np.ndarray) -> np.ndarray:
    """Vectors (24, p, e) of a beam in full at body coordinates q (q,)."""
    found = terms.position_gradients(beam.gather, q, q)
    assert found is not None
    return found
