r"""Discrete empirical interpolation (DEIM) of the elastic force, an elastic term of one's own, beside ECSW.

    U^T F(U xi + qbar) ~ D P^T F(U xi + qbar),    D = U^T Z (P^T Z)^-1

Z (n, k) holds the POD modes of force snapshots, P picks k of the n coordinates, one a mode, greedily where the interpolation of
the next mode errs most. Unlike that of ECSW this force is the gradient of no energy, and its tangent D P^T K U is not symmetric:
nothing keeps the energy of the reduced model. Here the whole force is evaluated and its rows are picked: accuracy and stability
are those of DEIM, speed is not looked at.

`main` reduces example 2 of Hou, Liu, Hu (2020), two flexible pendulums, and moves it with interpolated forces until it breaks down.

Source: Chaturantabut and Sorensen, SIAM J. Sci. Comput. 32 (2010) 2737-2764, doi 10.1137/090766498, algorithm 1 and lemma 3.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array

from fmbs_skfem import reduction, scenes
from fmbs_skfem.bodies.laws import Law
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.errors import InputError, SolverError, say
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.reduction import Snapshots
from fmbs_skfem.reduction.spaces.component import rows_of
from fmbs_skfem.reduction.spaces.pod import truncation
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import System, compile_system, compiled, eliminate
from fmbs_skfem.systems.affine import Affine, Matrix
from fmbs_skfem.systems.compiled import Compiled
from fmbs_skfem.systems.system import Elastic, Loads
from fmbs_skfem.systems.terms import elastic as terms
from fmbs_skfem.systems.terms.elastic import Lifts, Setting, Term

SCENE = Path(__file__).resolve().parent / "double_pendulum.yaml"
SCHEME = GeneralizedAlpha(5e-4)


@dataclass(frozen=True)
class ForceInterpolation:
    """f ~ modes (P^T modes)^-1 f[rows].

    f (n,) ~ Z (P^T Z)^-1 P^T f, with P^T f the entries f[rows]: k entries give the whole vector. Chaturantabut and Sorensen 2010,
    doi 10.1137/090766498.
    """

    modes: np.ndarray  #: (n, k), orthonormal
    rows: np.ndarray  #: (k,)

    @property
    def amplification(self) -> float:
        """||(P^T Z)^-1||_2: the error is at most so many times that of the best approximation (lemma 3.2)."""
        return float(1.0 / np.linalg.svd(self.modes[self.rows], compute_uv=False)[-1])

    def __call__(self, picked: np.ndarray) -> np.ndarray:
        """The vector from its values at `rows`."""
        return np.asarray(self.modes @ np.linalg.solve(self.modes[self.rows], picked))


@dataclass(frozen=True)
class Interpolated:
    """Elastic force of a reduced system as a term: D P^T F(U x + qbar), evaluated in Python.

    Its tangent is not symmetric and its force the gradient of no energy, see the module.
    """

    bodies: Compiled  #: the full system without loads, springs and damping by mass, which the reduced one has itself
    lift: Affine  #: U, qbar
    rows: np.ndarray  #: (k,) coordinates of which the force is read
    weights: np.ndarray  #: D (r, k)
    parts: Mapping[str, ForceInterpolation]  #: by component

    @property
    def law(self) -> Law:
        """That of the first body."""
        found: Law = self.bodies.system.elastic[0].gather.law
        return found

    def force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """D P^T F (r,)."""
        return np.asarray(
            self.weights
            @ compiled.forces(self.bodies, self.lift(x), self.lift.matrix @ v)[self.rows]
        )

    def tangent(self, x: np.ndarray, gh: float) -> np.ndarray:
        """D P^T (K + gh C) U (r, r), not symmetric."""
        none = np.zeros(self.bodies.constraints)
        K = compiled.tangent(self.bodies, self.lift(x), none, 0.0, gh)
        return np.asarray(self.weights @ (K[self.rows] @ self.lift.matrix))

    def energy(self, x: np.ndarray) -> float:
        """Strain energy of all bodies at U x + qbar [J], of which the force is not the derivative."""
        return compiled.strain_energy(self.bodies, self.lift(x))


def interpolation(modes: np.ndarray) -> ForceInterpolation:
    """The rows of algorithm 1: the largest entry of the first mode, then of what interpolation leaves of the next one.

    `modes` Z (n, k) are independent columns; one row is chosen a mode.
    """
    rows = [int(np.abs(modes[:, 0]).argmax())]
    for k in range(1, modes.shape[1]):
        before, mode = modes[:, :k], modes[:, k]
        rest = mode - before @ np.linalg.solve(before[rows], mode[rows])
        rows.append(int(np.abs(rest).argmax()))
    return ForceInterpolation(modes, np.array(rows))


def force_modes(forces: np.ndarray, tolerance: float) -> np.ndarray:
    """POD modes of force snapshots (n, s), not centred, up to the relative energy `tolerance`.

    Columns (n, k), at least one, k the smallest number with eps >= sum_{i>k} s_i^2 / sum_i s_i^2.
    """
    left, values, _ = np.linalg.svd(forces, full_matrices=False)
    return np.ascontiguousarray(left[:, : max(1, truncation(values, tolerance))])


def train(
    full: System,
    reduced: System,
    components: Mapping[str, Sequence[str]],
    data: Snapshots,
    tolerance: float = 1e-12,
) -> System:
    """The reduced system with the elastic forces of every component interpolated, from those at snapshots of the full system.

    `data` are states (s, q) of the full system, `tolerance` is eps of the force modes. Loads, springs and damping by mass stay as
    they are in the reduced system. InputError for a system that is not reduced.
    """
    if not reduced.components:
        raise InputError(say("deim.train", "a reduced system", "a full one", "reduce it first"))
    still = csr_array((full.size, full.size))
    alone = replace(full, loads=Loads(np.zeros(full.size)), damping=still, stiffness=still)
    bodies = compile_system(alone)
    F = np.stack([compiled.forces(bodies, q, 0.0 * q) for q in data.q], axis=1)
    U, picked, weights, parts = as_dense(reduced.lift.matrix), [], [], {}
    for name, members in components.items():
        own = rows_of(full, members)
        part = interpolation(force_modes(F[own], tolerance))
        picked.append(own[part.rows])
        weights.append(U[own].T @ np.linalg.solve(part.modes[part.rows].T, part.modes.T).T)
        parts[name] = part
    force = Interpolated(
        bodies, reduced.lift, np.concatenate(picked), np.concatenate(weights, axis=1), parts
    )
    return replace(reduced, elastic=(Elastic("interpolated", 0.0, force),))


@terms.split.register(Interpolated)
def split(force: Interpolated, lifts: Lifts) -> list[Interpolated]:
    """One piece."""
    return [force]


@terms.compile_term.register(Interpolated)
def compile_term(force: Interpolated, setting: Setting) -> Term:
    """Functions of Python in place of routines."""
    return terms.of_python(force)


@terms.carry.register(Interpolated)
def carry(force: Interpolated, name: str, lift: Affine, V: Matrix, d: np.ndarray) -> Interpolated:
    """Refused: its rows are chosen for its unknowns."""
    raise InputError(
        say(
            f"body '{name}'",
            "cells or sampled points",
            "an interpolated force",
            "reduce the system before",
        )
    )


def main(
    cells: int = 16, tolerance: float = 1e-8, training: float = 3.0, duration: float = 0.5
) -> dict[str, float]:
    """Rows that are read and all rows of both beams, and when the model breaks down [s]: `duration` where it does not."""
    raw = build.system(scenes.read(SCENE), cells)
    data = reduction.snapshots(integrate(eliminate(raw), SCHEME, training, Newton(1e-12), 10))
    parts = reduction.body_level(raw)
    small = reduction.reduce_system(raw, parts, reduction.bases(raw, data, parts, 1e-12))
    system = train(raw, small, parts, data, tolerance)
    try:
        end = float(integrate(system, SCHEME, duration, Newton(1e-10), 10).times[-1])
    except SolverError as error:
        end = error.time
    found = system.elastic[0].gather.parts.values()
    return {
        "rows": sum(len(part.rows) for part in found),
        "of": sum(len(part.modes) for part in found),
        "end": end,
    }


if __name__ == "__main__":
    print(main())
