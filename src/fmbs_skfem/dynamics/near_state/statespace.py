r"""A mechanism near an equilibrium as a linear system from named inputs to named outputs, its
constraints eliminated.

    u = V y,  Phi_x V = 0,  V^T M V = 1:      y'' + V^T C V y' + V^T K V y = V^T Q_w w                                         (1)
    z = (y, y'):                              z' = A z + B w,    outputs = C z + D w   (changes from those of the equilibrium)  (2)

V are the vibration modes of the symmetric part of K, all of them or the lowest. What the others
bend at rest is asked for as static correction, u = V y + R w (residual flexibility), whose part in
outputs is in D:

    K R + Phi_x^T l + M V k = Q_w,   Phi_x R = 0,   V^T M R = 0                                                                (3)

Outputs are differentiated with the accelerations and the multipliers that belong to a state by (1),
so that accelerations, reactions and forces have their part of the inputs in D.

Source: A. A. Shabana, Theory of Vibration, 3rd ed., Springer 2019, ch. 5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.algebra import ranks, saddle
from ...core.errors import InputError, closest, listed, say
from ...core.storage import durable
from ...core.storage.records import dataclass
from ...core.values import arrays
from ...core.values.arguments import checked
from ...systems import compiled
from ...systems.compiled import compile_system
from ...systems.measures import probes
from ...systems.signals import driving_inputs, inputs_of, with_inputs
from ...systems.system import Constraints, System, sizes
from ..outputs import outputs as read_outputs
from ..trajectory import Trajectory
from .linear import Linear
from .modes import real_modes

if TYPE_CHECKING:
    from scipy.signal import StateSpace as ScipyStateSpace

NUDGE = 1e-4  #: of an input that is differentiated: of its start, or of 1
# a stiff mode at the end of a beam bends it far for its size: reactions at rest err by less than
# 1e-4, where longer ways erred by 1e-3
SMALL = 1e-6  #: displacement in the mass norm over the size of the system, and velocity over that in a second, of outputs
INSTANT = 1e-9  #: time between the states of which outputs are differentiated [s]


@dataclass(frozen=True, repr=False)
class StateSpace:
    """The linear system (2); states z (k,) are amplitudes of modes, then their rates.

        z' = A z + B w,    y = C z + D w

    w (j,) and y (i,) are changes of the inputs and outputs from those of the equilibrium x (n,), in
    the `units`. A displacement is V z[:r], but for what `static` adds, with modes V (n, r) of unit
    mass.
    """

    A: np.ndarray  #: (k, k), k = 2 r
    B: np.ndarray  #: (k, j)
    C: np.ndarray  #: (i, k)
    D: np.ndarray  #: (i, j)
    inputs: tuple[str, ...]  #: (j,)
    outputs: tuple[str, ...]  #: (i,)
    units: dict[str, str]  #: of inputs and outputs, SI
    x: np.ndarray  #: (n,) the equilibrium
    basis: np.ndarray  #: (n, r) V
    weights: np.ndarray  #: (r, n) V^T M, of which amplitudes of displacements are made

    def __repr__(self) -> str:
        return f"<StateSpace {len(self.A)} states, {', '.join(self.inputs)} -> {', '.join(self.outputs)}>"

    def scipy(self) -> ScipyStateSpace:
        """The same as `scipy.signal.StateSpace`."""
        from scipy import signal

        return signal.StateSpace(self.A, self.B, self.C, self.D)

    @checked
    def states(self, motion: Trajectory) -> np.ndarray:
        """States (s, k) of a motion of the system, for feedback: amplitudes and their rates.

            z = (V^T M (x - x0), V^T M x')

        with x0 the equilibrium, for every stored state; `motion` has the unknowns (s, n) of the
        same system.
        """
        return np.concatenate(
            [(motion.x - self.x) @ self.weights.T, motion.v @ self.weights.T], axis=1
        )

    @checked
    def transfer(self, omega: Sequence[float] | np.ndarray) -> np.ndarray:
        """Transfer functions (s, i, j), complex, at angular frequencies `omega` (s,) [rad/s].

            C (i omega - A)^-1 B + D

        from inputs j to outputs i.
        """
        one = np.eye(len(self.A))
        omega = arrays.finite(omega, "transfer: omega", "frequencies (s,)", None, empty=True)
        return np.array(
            [self.C @ np.linalg.solve(1j * w * one - self.A, self.B) + self.D for w in omega]
        )

    def save(self, path: Path | str) -> Path:
        """Write A, B, C, D, the equilibrium, and names with units into a file .npz or .mat.

        The suffix decides; InputError for another one. The file appears under its name when it is
        complete.
        """
        path = Path(path)
        arrays: dict[str, Any] = {
            key: getattr(self, key) for key in ("A", "B", "C", "D", "x", "basis", "weights")
        }
        for key in ("inputs", "outputs"):
            names = getattr(self, key)
            arrays |= {
                key: np.array(names),
                f"{key}_units": np.array([self.units.get(name, "") for name in names]),
            }
        if path.suffix not in (".npz", ".mat"):
            raise InputError(say("save", "a file ending in .npz or .mat", path.name))
        with durable.place(path) as part, part.open("wb") as file:
            if path.suffix == ".npz":
                np.savez(file, **arrays)
            else:
                from scipy.io import savemat

                cells = {
                    key: values.astype(object)
                    for key, values in arrays.items()
                    if values.dtype.kind == "U"
                }
                savemat(file, arrays | cells, oned_as="column")
        return path


@checked
def state_space(
    system: System,
    linear: Linear,
    time: float = 0.0,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    count: int | None = None,
    static: bool = False,
) -> StateSpace:
    """The linear system (2) of a system about the equilibrium of its linear equations, which loads
    and drives have at `time` [s].

        z' = A z + B w,    y = C z + D w

    `inputs` are names of inputs, `outputs` of columns, all by default; `count` is the number of
    modes, the lowest, all by default, to which `static` adds (3): outputs are those of all modes
    then for inputs that are slow beside the modes left out. `linear` may be that of a load path at
    its end (`solve_statics`); `system` is the one over time. InputError for names that are none,
    and for inputs that drive joints: their accelerations would be inputs, too.
    """
    known = inputs_of(system)
    chosen = names_of("inputs", inputs, tuple(known))
    if bad := [name for name in chosen if name in driving_inputs(system)]:
        raise InputError(
            say(
                "linearise, inputs",
                "forces",
                f"'{bad[0]}', which drives a joint",
                "drive it by a torque or a force",
            )
        )
    possible = len(linear.x) - len(linear.rows)
    wanted = possible if count is None else min(count, possible)
    V = real_modes(linear, wanted).shapes
    push = np.stack(
        [slope(system, linear.x, time, name, known[name].start) for name in chosen], axis=1
    )
    r = V.shape[1]
    j = len(chosen)
    A = np.block(
        [
            [np.zeros((r, r)), np.eye(r)],
            [-V.T @ (linear.stiffness @ V), -V.T @ (linear.damping @ V)],
        ]
    )
    B = np.concatenate([np.zeros((r, j)), V.T @ push])
    # all modes, beside which are directions without mass: inputs move these at rest
    whole = r < wanted
    rest = (
        residual_flexibility(linear, V, push)
        if whole or (static and r < possible)
        else np.zeros_like(push)
    )
    motion = admitted(system, linear, time, V, np.concatenate([A, B], axis=1), push, rest)
    found = differentiate(
        system, linear, time, motion, {name: known[name].start for name in chosen}
    )
    columns = names_of("outputs", outputs, tuple(found))
    CD = np.array([found[name] for name in columns]).reshape(len(columns), 2 * r + j)
    units = {name: known[name].unit for name in chosen} | dict(probes.column_units(system.outputs))
    return StateSpace(
        A,
        B,
        CD[:, : 2 * r],
        CD[:, 2 * r :],
        chosen,
        columns,
        units,
        linear.x,
        V,
        np.asarray(V.T @ linear.mass),
    )


def names_of(what: str, wanted: Sequence[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    """The wanted names, all by default; InputError for none and for one that is not known."""
    for name in wanted or ():
        if name not in known:
            raise InputError(
                say(
                    f"linearise, {what}",
                    f"one of {listed(known, name)}",
                    f"'{name}'{closest(name, known)}",
                )
            )
    if not known:
        raise InputError(
            say(f"linearise, {what}", "at least one", "none", f"name it in the section {what}")
        )
    return known if wanted is None else tuple(wanted)


def nudged(system: System, name: str, value: float) -> System:
    """The system with an input held at a value."""
    return with_inputs(system, {name: lambda t: np.full(np.shape(t), value)})


def slope(system: System, x: np.ndarray, time: float, name: str, start: float) -> np.ndarray:
    """What one input w pushes, (n,), at rest in x (n,), from loads alone, by a central difference
    that is exact where they are linear.

        dQ/dw

    `start` is the value of the input `name` about which it is taken, `time` [s] that of the loads.
    """
    alone = replace(system, elastic=(), constraints=Constraints(), full=None)
    h = NUDGE * max(abs(start), 1.0)
    still = np.zeros(system.size)
    up, down = (
        compiled.forces(compile_system(nudged(alone, name, start + s * h)), x, still, time)
        for s in (1.0, -1.0)
    )
    return np.asarray((down - up) / (2.0 * h))


def residual_flexibility(linear: Linear, V: np.ndarray, push: np.ndarray) -> np.ndarray:
    """What the modes that are left out bend at rest, R (n, j) of (3).

        K R + Phi_x^T l + M V k = Q_w,    Phi_x R = 0,    V^T M R = 0

    for modes V (n, r) and inputs that push by Q_w (n, j).
    """
    rows = np.concatenate([linear.rows, V.T @ linear.mass])
    found = saddle.regular_solution(
        saddle.matrix(linear.stiffness, rows), np.pad(push, [(0, len(rows)), (0, 0)])
    )
    if found is None:
        raise InputError(
            say(
                "linearise, static",
                "modes with all free motions among them",
                f"{V.shape[1]} modes",
                "take more",
            )
        )
    return found[: len(push)]


def admitted(
    system: System,
    linear: Linear,
    time: float,
    V: np.ndarray,
    AB: np.ndarray,
    push: np.ndarray,
    rest: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Changes by (1) of x, x', x'' (n, k + j) and multipliers (m, k + j) with states and inputs, AB
    (k, k + j), rest R (n, j).
    """
    r = V.shape[1]
    whole = AB.shape[1]
    x, v, a = V @ np.eye(r, whole), V @ np.eye(r, whole, r), V @ AB[r:]
    x[:, 2 * r :] = rest
    J = compiled.gap(compile_system(system), linear.x, time)[1]
    force = (
        np.pad(push, [(0, 0), (2 * r, 0)])
        - linear.mass @ a
        - linear.damping @ v
        - linear.stiffness @ x
    )
    return x, v, a, ranks.least(J.T, force) if len(J) else np.zeros((0, whole))


def differentiate(
    system: System,
    linear: Linear,
    time: float,
    motion: tuple[np.ndarray, ...],
    inputs: Mapping[str, float],
) -> dict[str, np.ndarray]:
    """Derivatives (k + j,) of all output columns along states and inputs, by central differences
    about the equilibrium.

    Reactions hold the multipliers of the equilibrium as well, whose directions change with x.
    """
    j = len(inputs)
    starts = np.array(list(inputs.values()))
    states = motion[0].shape[1] - j
    size = sizes(system, (motion[0] + motion[1]).T)
    h = SMALL * system.scale / np.where(size > 0.0, size, 1e-300)
    # what bends at rest stays as little bent
    h[states:] = np.minimum(h[states:], NUDGE * np.maximum(np.abs(starts), 1.0))
    sides = []
    for sign in (1.0, -1.0):
        moved = [sign * h * part for part in motion]
        parts = [readings(system, linear, time, [part[:, :states] for part in moved])]
        for k, (name, start) in enumerate(inputs.items(), start=states):
            parts.append(
                readings(
                    nudged(system, name, start + sign * h[k]),
                    linear,
                    time,
                    [part[:, [k]] for part in moved],
                )
            )
        sides.append({name: np.concatenate([part[name] for part in parts]) for name in parts[0]})
    return {name: (values - sides[1][name]) / (2.0 * h) for name, values in sides[0].items()}


def readings(
    system: System, linear: Linear, time: float, changes: Sequence[np.ndarray]
) -> dict[str, np.ndarray]:
    """All output columns (s,) of states that differ by `changes` (n, s) of x, x', x'' and (m, s) of
    multipliers, at one time.

    They follow the equilibrium, from which potential energies count; the balance of energies is
    unknown, as of equilibria.
    """
    rest = np.zeros_like(linear.x)
    base = linear.x, rest, rest, np.broadcast_to(linear.multipliers, len(changes[3]))
    x, v, a, multipliers = (
        np.vstack([one, one + part.T]) for one, part in zip(base, changes, strict=True)
    )
    times = time + INSTANT * np.arange(len(x))
    found = read_outputs(
        Trajectory(system, times, x, v, a, multipliers, work=np.full(len(x), np.nan))
    )
    return {name: values[1:] for name, values in found.items()}
