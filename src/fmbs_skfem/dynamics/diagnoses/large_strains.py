r"""Strains beyond what laws of small strains mean: axial ones of lines, principal ones of surfaces
and of beams, which shear.

    E = (stretch^2 - 1)/2,    force of a bar / (EA (stretch - 1)) = stretch (stretch + 1) / 2

The laws of this package are linear in Green's strain E: their forces are those of Hooke's law where
strains are small. At a stretch of 1.1 a bar is pulled by 1.16 times as much, at 1.5 by 1.9 times;
below 0.58 it gives way. Beams with torsion are linear in stretch and shear of a section that keeps
its size. Energies of one's own are not looked at.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...bodies.laws import Law
from ...bodies.stress_recovery import beam_strains, carrying, extreme_strains, principal_strains
from ...core.algebra.linalg import evenly
from ...core.storage.records import dataclass
from ...systems.system import System
from ...systems.terms import elastic as terms
from ..outputs import centre_lines, skins
from ..tracing import FEW
from ..trajectory import Trajectory
from . import stopped

LARGE = 0.1  #: strain from which is warned: forces are then off by 15 %; half of it is 7 %
ROUND_OFF = 1e-12  #: of the size of the system, below which a place is 0
#: laws that are linear in strains
SMALL = (
    Law.QUADRATIC,
    Law.MATERIAL,
    Law.EXACT,
    Law.MEMBRANE,
    Law.SHELL,
    Law.BEAM,
    Law.PLANAR_BEAM,
    Law.SOLID,
)


@dataclass(frozen=True)
class LargeStrain:
    """Where a body is strained most in a motion, or on a path of equilibria."""

    body: str
    strain: float  #: Green's, with its sign
    at: float  #: time [s], or load factor
    place: tuple[float, ...]  #: where it is then [m]; nothing where the model does not know
    shear: float | None = None  #: of a beam with torsion there; None of other bodies

    def __str__(self) -> str:
        stretch = float(np.sqrt(max(1.0 + 2.0 * self.strain, 0.0)))
        where = f" near ({', '.join(f'{x:.3g}' for x in self.place)}) m" if self.place else ""
        if self.shear is None:
            force = f"a bar with that stretch of {stretch:.3g} has {0.5 * stretch * (stretch + 1.0):.2g} times the force of Hooke's law"
        else:
            force = f"with a shear of {self.shear:.2g}, while its section keeps its size"
        return f"'{self.body}' is strained by {100 * self.strain:.3g} %{where} at {self.at:.4g}, {force}"


def find(trajectory: Trajectory) -> list[LargeStrain]:
    """Bodies with strains above LARGE, each where it has the largest of the states that are looked
    at.

    Looked at are up to 40 states of the motion, and bodies whose laws are linear in Green's strain;
    LARGE is 0.1.
    """
    trajectory = trajectory.states
    system = trajectory.system
    worst = dict[str, LargeStrain]()
    small = {one.name for one in system.elastic if one.gather.law in SMALL}
    for k in evenly(0, len(trajectory.times) - 1, FEW):
        for name, (low, high) in stopped.strains(system, trajectory.x[k]).items():
            largest = high if high >= -low else low
            known = worst[name].strain if name in worst else LARGE
            if name in small and abs(largest) > abs(known):
                place, shear = worst_point(system, trajectory.x[k], name, largest < 0.0)
                worst[name] = LargeStrain(name, largest, float(trajectory.times[k]), place, shear)
    return list(worst.values())


def worst_point(
    system: System, x: np.ndarray, name: str, shortened: bool
) -> tuple[tuple[float, ...], float | None]:
    """Where a body is strained most in a state (n,) [m], and the shear of a beam there."""
    elastic = next(one for one in system.elastic if one.name == name)
    law = elastic.gather.law
    if law.fields == 1:
        return place_of(system, x, name, shortened), None
    section = elastic.gather.section
    u = terms.position_gradients(elastic.gather, x, system.lift(x))
    assert u is not None
    strain = extreme_strains(law, section, u, system.dim).reshape(2, -1)
    used = carrying(law, section)
    point = int(strain[0].argmin() if shortened else strain[1].argmax())
    return shown(system, u[: system.dim, used][:, point]), float(
        np.hypot(*beam_strains(u, section)[1:3, used][:, point])
    )


def place_of(system: System, x: np.ndarray, name: str, shortened: bool) -> tuple[float, ...]:
    """Where a body is strained most in a state (n,), from the samples that pictures take of it."""
    q = system.lift(x)
    sign = -1.0 if shortened else 1.0
    sampled = {one: found[0] for one, found in centre_lines(system, q[None]).items()}
    lines = [
        (one, found[0], 0.5 * (np.sum(found[1] ** 2, axis=1) - 1.0))
        for one, found in sampled.items()
    ]
    surfaces = [
        (one.name, *on_surface(one.law, skins(system, q)[one.name], shortened))
        for one in system.skins
        if one.name == name
    ]
    for one, places, strain in [*lines, *surfaces]:
        if one == name and len(places):
            return shown(system, places[int(np.argmax(sign * strain))])
    return ()


def shown(system: System, place: np.ndarray) -> tuple[float, ...]:
    """A place (c,) [m] from the origin of the scene, without round-off."""
    place = place + system.origin
    return tuple(np.where(np.abs(place) > ROUND_OFF * system.scale, place, 0.0).tolist())


def on_surface(law: Law, found: np.ndarray, shortened: bool) -> tuple[np.ndarray, np.ndarray]:
    """Places (x, c) and the largest or smallest principal strains (x,) of samples (1 + k, x, c) of
    a surface, or the boundary of a solid.
    """
    u = found[1 : 1 + law.tangents].transpose(0, 2, 1).reshape(-1, found.shape[1])
    return found[0], principal_strains(law, u, found.shape[2])[int(shortened)]


def summarise(found: list[LargeStrain]) -> Iterator[str]:
    """One warning of all bodies."""
    if not found:
        return
    worst = max(found, key=lambda one: abs(one.strain))
    others = [f"'{one.body}'" for one in found if one is not worst]
    more = f"; strains above {100 * LARGE:.0f} % as well: {', '.join(others)}" if others else ""
    law = (
        "laws are linear in Green's strain, as for small ones: take an energy of your own for large ones"
        if worst.shear is None
        else "forces of beams with torsion are linear in stretch and shear, as for small ones"
    )
    yield f"{worst}{more}; {law}"
