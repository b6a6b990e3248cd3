"""What changes at once behind an event, in compiled code, against matrices of NumPy, and printed as C."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.sparse import csr_array

from fmbs_skfem.bodies import body
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core.algebra import pivoting, ranks
from fmbs_skfem.core.algebra.linalg import as_dense
from fmbs_skfem.core.compiling.structs import address_of, packed
from fmbs_skfem.core.errors import Contradiction, SolverError
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, initial
from fmbs_skfem.dynamics.compiled_step import factors, impulses
from fmbs_skfem.dynamics.compiled_step.packing import UNSTORED, PackedStep
from fmbs_skfem.dynamics.compiled_step.step import Step
from fmbs_skfem.dynamics.scheme import method_of
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import (
    At,
    Motion,
    Rayleigh,
    System,
    assemble,
    compile_system,
    eliminate,
    layouts,
)
from fmbs_skfem.systems import compiled as compilation
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.layouts import Storage
from tests import models
from tests.dynamics.test_plain import arms
from tests.dynamics.test_starting import SHOWN, InC
from tests.exports.c_library import COMPILER

SCHEME = GeneralizedAlpha(1e-3)
DOWN = loads.Gravity((0.0, -9.81))


def deficient(seed: int, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Rows of which some depend on others but for a part `near` of their length, and which come
    first.
    """
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(7, 9)) * 10.0 ** rng.uniform(-6.0, 6.0, size=(7, 1))
    unit = a / np.linalg.norm(a, axis=1)[:, None]
    for k, others in ((2, [0, 1]), (5, [3, 4, 6]), (6, [0])):
        a[k] = rng.normal(size=len(others)) @ unit[others] + near * rng.normal(size=9)
    a[3] = 0.0 if seed % 3 == 0 else a[3]
    return a, rng.uniform(size=7) < 0.5


@pytest.mark.parametrize("near", [0.0, 1e-11, 1e-6])
@pytest.mark.parametrize("seed", range(6))
def test_rows_are_independent_as_ranks_has_it(seed: int, near: float) -> None:
    """With 1e-8 as the tolerance, of rows that come first and of all alike, in their span."""
    a, first = deficient(seed, near)
    for ahead in (first, np.ones(7, dtype=bool)):
        rows = pivoting.room_for(*a.shape)
        rows.unit[:], rows.group[:] = a, np.where(ahead, 1, 2)
        pivoting.scale_rows(rows)
        count = pivoting.take_rows(rows, 2, pivoting.take_rows(rows, 1, 0, 1e-8), 1e-8)
        pivoting.find_weights(rows, count)
        base, rest, _ = ranks.part(a, 1e-8, ahead)
        taken = rows.order[:count]
        assert count == len(base)
        assert ahead[taken].sum() == ahead[base].sum()
        assert sorted(np.flatnonzero(rows.group > 0)) == sorted(set(range(7)) - set(taken))
        Q = rows.unit[taken]
        np.testing.assert_allclose(Q @ Q.T, np.eye(count), atol=1e-14)
        size = ranks.lengths(a)
        for k in np.flatnonzero(rows.group > 0):
            gap = a[k] - rows.shares[k, :count] @ a[taken]
            assert np.linalg.norm(gap) < 2e-8 * size[k]
        assert len(rest) == 7 - count


def arm(*held: joints.Joint, damping: float = 0.0, cells: int = 3) -> System:
    """A beam that turns on a pin, with joints that events release or lock."""
    part = body.cable("beam", segment(cells), models.SECTION, models.MATERIAL, dim=2)
    system = assemble(
        [part],
        [joints.Pin("pin", At("beam", "left")), *held],
        [DOWN],
        Rayleigh(stiffness=damping),
        initial={"beam": Motion(None, 2.0)},
    )
    return loosen(system, *(one.name for one in held))


def moving(system: System) -> System:
    """The system with velocities that its joints do not admit."""
    return replace(system, v0=np.random.default_rng(2).normal(size=system.size))


PLACES = {"a": (0.0, 0.0), "b": (1.0, 0.0)} | {f"at {x}": (x, 0.0) for x in (0.0, 0.5, 1.0)}


def rod(*held: joints.Joint) -> System:
    """A rigid rod of 1 m in the plane that moves and turns."""
    part = rigid("rod", 0.3, 0.02, (0.5, 0.0), dim=2, places=PLACES)
    system = assemble([part], held, [DOWN], initial={"rod": Motion((0.5, -1.0), 3.0)})
    return loosen(system, *(one.name for one in held))


def link(name: str, place: float) -> joints.Joint:
    """What holds a place of the rod to another one above it."""
    return joints.RigidLink(name, At("rod", f"at {place}"), (place, 0.7))


def loosen(system: System, *names: str) -> System:
    """The system with joints that events may release or lock."""
    return eliminate(
        replace(system, constraints=replace(system.constraints, loose=frozenset(names)))
    )


class Case(NamedTuple):
    """A system, its rows that are to be off, and those that follow from others."""

    system: System
    off: Sequence[str] = ()
    follow: int = 0
    layout: Mapping[str, float] = {}  #: what of `layouts` makes it be stored otherwise


ROD_A, ROD_B = At("rod", "a"), At("rod", "b")
TIP = At("beam", "right")
CASES: dict[str, Callable[[], Case]] = {
    "a rod that locks": lambda: Case(rod(joints.Pin("pin", ROD_A))),
    "a rod that is released": lambda: Case(
        rod(joints.Pin("pin", ROD_A), joints.Clamp("wall", ROD_B)), ("wall",)
    ),
    "two locks that say the same": lambda: Case(
        rod(joints.Pin("pin", ROD_A), joints.Clamp("wall", ROD_B)), (), 2
    ),
    "a rod between walls in one line": lambda: Case(
        rod(joints.Pin("pin", ROD_A), joints.Pin("far", ROD_B)), (), 1
    ),
    "a beam whose tip locks": lambda: Case(arm(joints.Pin("wall", TIP))),
    "a damped beam whose tip locks": lambda: Case(arm(joints.Pin("wall", TIP), damping=5e-3)),
    "a rod on three links side by side": lambda: Case(
        loosen(rod(*(link(f"link{k}", k / 2) for k in range(3))))
    ),
    "a band": lambda: Case(arm(joints.Pin("wall", TIP), cells=9), layout={"DENSE": 1}),
    "blocks": lambda: Case(
        moving(replace(arms(), constraints=replace(arms().constraints, loose=frozenset({"p2"})))),
        layout={"DENSE": 1, "WORTH": 10.0},
    ),
    "sparse": lambda: Case(
        arm(joints.Pin("wall", TIP), damping=1e-3), layout={"DENSE": 1, "BAND": 1}
    ),
    "all that holds a beam is open": lambda: Case(arm(joints.Pin("wall", TIP)), ("wall",)),
}


class Begun(NamedTuple):
    """A step in a moving state."""

    packed: PackedStep
    step: Step


def begun(system: System, off: Sequence[str] = ()) -> Begun:
    """A step in the state of the start, whose joints it does not meet with its velocities."""
    model = compile_system(system)
    step = initial.first_step(
        model, system.x0, system.v0, method_of(SCHEME, Newton(), SCHEME.step, model)
    )
    packed_step = PackedStep(model, step, initial.large_of(model))
    names = [joint for joint, _ in system.constraints.names]
    step.space.off[:] = [name in off for name in names]
    rng = np.random.default_rng(1)
    step.state.a[:] = rng.normal(size=system.size)
    return Begun(packed_step, step)


def filtered(begin: Begun, J: np.ndarray) -> np.ndarray:
    """The change of velocities by an impulse, with matrices."""
    model, method = begin.packed.model, begin.step.method
    system = model.system
    M = as_dense(system.mass)
    n, m = system.size, len(J)
    K = as_dense(compilation.elastic_tangent(model, system.x0, factors.DAMPING * method.gh))
    K = K + factors.DAMPING * method.gh * as_dense(system.damping) + as_dense(system.stiffness)
    W = M + K / method.bh if system.elastic else M

    def d(f: np.ndarray) -> np.ndarray:
        A = np.block([[W, J.T], [J, np.zeros((m, m))]])
        found = np.linalg.lstsq(A, np.concatenate([f, -J @ system.v0]), rcond=1e-13)[0]
        return np.asarray(found[:n])

    once = d(np.zeros(n))
    return 2.0 * once - d(M @ once) if system.elastic else once


@pytest.mark.parametrize("name", CASES)
def test_a_motion_goes_on_as_matrices_say(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Velocities by the equation of the module; q'' and multipliers balance all forces, these of
    least norm.
    """
    case = CASES[name]()
    for word, value in case.layout.items():
        monkeypatch.setattr(layouts, word, value)
    begin = begun(case.system, case.off)
    if case.layout:
        assert begin.packed.model.layout.storage is Storage(name.removeprefix("a "))
    model, step = begin.packed.model, begin.step
    system = model.system
    order = model.order
    names = [joint for joint, _ in system.constraints.names]
    found = initial.begin_anew(begin.packed, SCHEME, 0.0, step.state.a.copy())
    off = step.space.off > 0.0
    follow = off & ~np.isin(names, case.off)
    assert follow.sum() == case.follow
    _, J = compilation.gap(model, system.x0)
    on = J[~off]
    change = filtered(begin, on)
    v = found.v[np.argsort(order)]
    size = np.abs(system.v0).max()
    np.testing.assert_allclose(v, system.v0 + change, rtol=0, atol=1e-9 * size)
    np.testing.assert_allclose(on @ v, 0.0, atol=1e-9 * size)
    M = as_dense(system.mass)
    loss = 0.5 * (system.v0 @ M @ system.v0 - v @ M @ v)
    assert found.loss[0] == pytest.approx(loss, rel=1e-9, abs=1e-12)
    a = step.state.acceleration[np.argsort(order)]
    held = step.state.multipliers / step.method.c
    gap = compilation.evaluate(model, system.x0, v, 0.0, None, held, a)[0]
    forces = np.abs(compilation.forces(model, system.x0, v)).max() + np.abs(M @ a).max()
    np.testing.assert_allclose(gap, 0.0, atol=1e-9 * forces)
    least = np.linalg.lstsq(on.T, on.T @ held[~off], rcond=1e-9)[0]
    np.testing.assert_allclose(held[~off], least, atol=1e-9 * max(np.abs(held).max(), 1e-9))
    assert not held[off].any()


def test_what_is_read_leaves_a_state_to_the_bit() -> None:
    """Of a motion under way, with accelerations and reactions that balance all forces."""
    system = arm(joints.Pin("wall", TIP), joints.Clamp("late", TIP), damping=1e-3)
    begin = begun(system, ("late",))
    model, state = begin.packed.model, begin.step.state
    initial.begin_anew(begin.packed, SCHEME, 0.0, np.zeros(model.system.size))
    rng = np.random.default_rng(4)
    for part in (state.history, state.past, state.multipliers, state.a):
        part += rng.normal(size=part.shape)
    state.known[0], state.order[0], state.parts[0] = 3, 2, 1
    before = [part.copy() for part in (*state, begin.step.space.off)]
    begin.step.work.kind[:] = 7, 0, 7, 7
    a, held = initial.balance(begin.packed, SCHEME, 0.0)
    for got, wanted in zip((*state, begin.step.space.off), before, strict=True):
        np.testing.assert_array_equal(got, wanted)
    assert begin.step.work.kind.tolist() == [0, 0, 0, 0]
    back = np.argsort(model.order)
    x, v, a = state.x[back], state.v[back], a[back]
    gap = compilation.evaluate(model, x, v, 0.0, None, held, a)[0]
    forces = np.abs(compilation.forces(model, x, v)).max()
    np.testing.assert_allclose(gap, 0.0, atol=1e-9 * forces)
    assert np.abs(held).max() > 0.1
    assert not held[begin.step.space.off > 0.0].any()


def test_rows_that_are_open_are_an_error_by_name() -> None:
    begin = begun(rod(joints.Pin("pin", ROD_A), joints.Pin("far", ROD_B)))
    begin.step.state.x[0] += 0.01
    with pytest.raises(Contradiction, match=r"does not satisfy the joints.*pin\.x by 0\.01"):
        initial.begin_anew(begin.packed, SCHEME, 0.0)


@pytest.mark.parametrize("layout", [{}, {"DENSE": 1, "BAND": 1}])
def test_what_nothing_holds_is_an_error_by_name(
    layout: dict[str, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A point without mass at the tip of a beam, which goes on with it until it is released."""
    for word, value in layout.items():
        monkeypatch.setattr(layouts, word, value)
    part = body.cable("beam", segment(2), models.SECTION, models.MATERIAL, dim=2)
    ghost = body.point_mass("ghost", 1.0, np.array([1.0, 0.0]))
    held = [joints.Clamp("wall", At("beam", "left")), joints.Pin("hook", At("ghost"), TIP)]
    plain = loosen(assemble([part, ghost], held, [DOWN]), "hook")
    mass = as_dense(plain.mass).copy()
    light = [k for k in range(len(mass)) if mass[k, k] == 1.0]
    mass[light, light] = 0.0
    system = replace(plain, mass=csr_array(mass))
    begin = begun(system)
    initial.begin_anew(begin.packed, SCHEME, 0.0)
    begin.step.space.off[:] = 1.0
    with pytest.raises(
        SolverError, match="neither joints nor a mass determine the motion of ghost"
    ):
        initial.begin_anew(begin.packed, SCHEME, 0.0)


#: of a record beside a step
RESULTS = "off", "v", "loss", "acceleration", "multipliers"
PRINTED = ("a damped beam whose tip locks", "a rod on three links side by side")


@pytest.mark.skipif(COMPILER is None, reason="no C compiler")
@pytest.mark.parametrize("name", PRINTED)
def test_what_is_printed_goes_on_the_same_way(name: str, tmp_path: Path) -> None:
    """To the bit, as no sine and no product by BLAS stands between them."""
    case = CASES[name]()
    begin = begun(case.system, case.off)
    packed_step, step = begin.packed, begin.step
    step.state.acceleration[:] = step.state.a
    initial.impulse_of(packed_step)
    packed_step.give(np.zeros((1, 0)), UNSTORED)
    step = step._replace(job=step.job._replace(work=np.zeros(0), signals=packed_step.given[0]))
    table = packed(step)
    beside = impulses.Impulse, packed_step.beside
    calls = {
        "read": (impulses.balance_known, packed_step.beside),
        "go_on": (impulses.begin_anew, packed_step.beside),
    }
    other = InC(address_of(table), calls, tmp_path, beside)
    for routine_of, word in ((impulses.balance_known, "read"), (impulses.begin_anew, "go_on")):
        assert routine_of(table, packed_step.beside) == other.call(word) == 0
        fields = {f"state_{one}": getattr(step.state, one) for one in SHOWN[1:]}
        fields |= {f"beside_{one}": getattr(packed_step.impulse, one) for one in RESULTS}
        for field, wanted in fields.items():
            if wanted.size:
                got = other.array(field, wanted.size)
                np.testing.assert_array_equal(got, wanted.ravel(), err_msg=field)
