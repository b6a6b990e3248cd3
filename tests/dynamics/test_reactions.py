"""Forces of joints: recovered for eliminated rows, multipliers for kept ones, equal where both are
known.
"""

from __future__ import annotations

from ast import literal_eval
from collections.abc import Callable

import numpy as np
import pytest
from scipy.sparse import csr_array, vstack

from fmbs_skfem.bodies import body, rigid, sections
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.control import events
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    integrate,
    outputs,
    reactions,
    solve_statics,
)
from fmbs_skfem.systems import At, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads, springs
from fmbs_skfem.systems.measures import probes
from verification import statics_shells

from .. import models

TIGHT = Newton(tolerance=1e-13)
PAIR = {"base": 0.0, "arm": 1.0}
CORNER = {"column": ((0.0, -1.0, 0.0), (0.0, 0.0, 0.0)), "beam": ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))}


@pytest.mark.parametrize("make", [models.spin_up, models.double_pendulum])
def test_eliminated_joints_carry_the_multipliers(make: Callable[..., System]) -> None:
    # both iterate with factors of their own, and reactions err by 1 / (beta h^2) times what Newton
    # leaves
    newton = Newton(tolerance=1e-14)
    found, kept = (
        integrate(make(10, all_multipliers=full), GeneralizedAlpha(5e-4), 0.2, newton)
        for full in (False, True)
    )
    assert len(found.system.constraints.names) < len(kept.system.constraints.names)
    recovered, multipliers = reactions(found), reactions(kept)
    assert recovered.keys() == multipliers.keys()
    for name, values in multipliers.items():
        np.testing.assert_allclose(recovered[name], values, atol=5e-6)


def test_both_forms_move_alike() -> None:
    found, kept = (
        outputs(
            integrate(
                models.double_pendulum(10, all_multipliers=full), GeneralizedAlpha(5e-4), 0.2, TIGHT
            )
        )
        for full in (False, True)
    )
    for column in ("B_x", "B_y", "B_z", "C_x", "C_y", "C_z"):
        np.testing.assert_allclose(found[column], kept[column], atol=1e-9)


@pytest.mark.parametrize("all_multipliers", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
def test_clamp_carries_the_weight(all_multipliers: bool, dim: int) -> None:
    """Vertical force = rhoA L g, moment = weight times the lever arm, which is the centre of mass
    of the bent beam.
    """
    section = sections.Given(EA=1e6, EI=100.0, rhoA=1.0)
    down = (0.0, -9.81, 0.0)[:dim]
    cantilever = models.cantilever(
        20,
        lambda _: [loads.Gravity(down)],
        section=section,
        dim=dim,
        all_multipliers=all_multipliers,
    )
    found = solve_statics(cantilever, 2, TIGHT)
    forces = {name: values[-1] for (_, name), values in reactions(found).items()}
    assert forces["x"] == pytest.approx(0.0, abs=1e-9)
    assert forces["y"] == pytest.approx(9.81, rel=1e-10)
    q = found.system.lift(found.x[-1])
    arm = q[0::dim] @ (
        body.cable("beam", models.segment(20), section, dim=dim).mass.toarray().sum(axis=0)
    )
    moment = np.hypot(forces["slope 1"], forces.get("slope 2", 0.0))
    assert moment == pytest.approx(
        9.81 * arm, rel=1e-4
    )  # the slope's length at the clamp is 1 up to the strain of bending


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    "form", [eliminate, lambda system: system], ids=["eliminated", "multipliers"]
)
def test_the_moment_of_a_clamp_is_about_the_axes_that_stand_beside_its_columns(
    dim: int, form: Callable[[System], System]
) -> None:
    """A light tip load F pulls a horizontal beam of length L down: the clamp holds it by the moment
    F L about z.
    """
    beam = body.cable(
        "beam", models.segment(10), sections.Given(EA=1e6, EI=100.0, rhoA=1.0), dim=dim
    )
    tip = loads.PointForce("tip", At("beam", "right"), (0.0, -1e-3, 0.0)[:dim])
    held = {"root": probes.Reaction("root")}
    system = form(assemble([beam], [joints.Clamp("root", At("beam", "left"))], [tip], outputs=held))
    labels, found = probes.column_labels(system.outputs), outputs(solve_statics(system, 1, TIGHT))
    axes = {
        column: text.removeprefix("moment about ")
        for column, text in labels.items()
        if text.startswith("moment")
    }
    named = {"z": np.array([0.0, 0.0, 1.0]), "-z": np.array([0.0, 0.0, -1.0])}
    moment = sum(
        found[column][-1] * (named[text] if dim == 2 else np.array(literal_eval(text)))
        for column, text in axes.items()
    )
    np.testing.assert_allclose(moment, [0.0, 0.0, 1e-3], atol=1e-9)
    assert labels["root_y"] == "force along y"
    assert {
        column: unit
        for column, unit in probes.column_units(system.outputs).items()
        if column in axes
    } == dict.fromkeys(axes, "N m")


def moment_on(system: System, found: Trajectory) -> np.ndarray:
    """Of the joint that the outputs show, by the axes beside its columns (3,) [N m]."""
    labels, values = probes.column_labels(system.outputs), outputs(found)
    named = {
        "moment about z": np.array([0.0, 0.0, 1.0]),
        "moment about -z": np.array([0.0, 0.0, -1.0]),
    }
    axes = {
        name: named[text] if text in named else np.array(literal_eval(text[13:]))
        for name, text in labels.items()
        if "about" in text
    }
    return np.asarray(sum(values[name][-1] * axis for name, axis in axes.items()))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("turned", [False, True])
def test_moments_act_on_the_first_of_two_places(dim: int, turned: bool) -> None:
    """A clamped hub holds a beam with a load F at L: the weld pushes the beam by F L about z, and
    the hub by the opposite.
    """
    beam = body.cable(
        "beam", models.segment(4), sections.Given(EA=1e6, EI=100.0, rhoA=1.0), dim=dim
    )
    hub = rigid.rigid("hub", 1.0, 1.0 if dim == 2 else (1.0, 1.0, 1.0), (0.0,) * dim, dim=dim)
    ends = At("beam", "left"), At("hub", "frame")
    held = [
        joints.Clamp("root", At("hub", "frame")),
        joints.Weld("weld", *(ends[::-1] if turned else ends)),
    ]
    tip = loads.PointForce("tip", At("beam", "right"), (0.0, -1e-3, 0.0)[:dim])
    system = eliminate(
        assemble([beam, hub], held, [tip], outputs={"weld": probes.Reaction("weld")})
    )
    moment = moment_on(system, solve_statics(system, 1, TIGHT))
    np.testing.assert_allclose(moment, [0.0, 0.0, -1e-3 if turned else 1e-3], atol=1e-9)


def test_the_moment_of_a_corner_in_the_plane() -> None:
    """A column and a beam at right angles: their weld holds the beam, of length 1, by its load
    times that length.
    """
    section = sections.Given(EA=1e6, EI=100.0, rhoA=1.0)
    column, beam = (
        body.cable(name, models.segment(4, *ends), section, dim=2) for name, ends in CORNER.items()
    )
    held = [
        joints.Clamp("root", At("column", "left")),
        joints.Weld("corner", At("beam", "left"), At("column", "right")),
    ]
    tip = loads.PointForce("tip", At("beam", "right"), (0.0, -1e-3))
    system = eliminate(
        assemble([column, beam], held, [tip], outputs={"corner": probes.Reaction("corner")})
    )
    np.testing.assert_allclose(
        moment_on(system, solve_statics(system, 1, TIGHT)), [0.0, 0.0, 1e-3], atol=1e-8
    )


def test_the_moment_of_a_universal_joint_is_about_the_normal_of_its_axes() -> None:
    cross = rigid.rigid("cross", 1.0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    held = [joints.Universal("joint", At("cross", "frame"), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))]
    twist = loads.Torque("twist", At("cross", "frame"), (0.0, 0.0, 3.0))
    system = eliminate(
        assemble([cross], held, [twist], outputs={"joint": probes.Reaction("joint")})
    )
    assert probes.column_units(system.outputs)["joint_axes"] == "N m"
    np.testing.assert_allclose(
        moment_on(system, integrate(system, GeneralizedAlpha(1e-3), 2e-3)),
        [0.0, 0.0, -3.0],
        atol=1e-9,
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_what_a_lock_carries_stands_beside_its_columns(dim: int) -> None:
    """A block of 2 kg that is caught 1 m to the right of its centre: m g up, and m g times that
    about -z.
    """
    block = rigid.rigid(
        "block",
        2.0,
        1.0 if dim == 2 else (1.0, 1.0, 1.0),
        (0.0,) * dim,
        dim=dim,
        places={"end": (1.0, 0.0, 0.0)[:dim]},
    )
    catch = events.Latch("catch", At("block", "end"))
    now = {"now": events.Event(when=of_state("t - 2e-3"), lock=("catch",))}
    down, held = [loads.Gravity((0.0, -10.0, 0.0)[:dim])], {"catch": probes.Reaction("catch")}
    system = eliminate(assemble([block], [catch], down, outputs=held, events=now))
    found = integrate(system, GeneralizedAlpha(1e-3), 5e-3)
    np.testing.assert_allclose(moment_on(system, found), [0.0, 0.0, -20.0], rtol=1e-3, atol=1e-9)
    assert outputs(found)["catch_y_locked"][-1] == pytest.approx(20.0)
    assert probes.column_labels(system.outputs)["catch_y_locked"] == "force along y"


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "cylindrical"])
def test_axes_of_reactions_turn_with_the_body_that_carries_the_joint(kind: str) -> None:
    """A base that turns by 90 degrees about z takes an arm of 2 kg along, 1 m out: it is held by
    -20 N m about the base's y.
    """
    base, arm = (
        rigid.rigid(name, 2.0, (1.0, 1.0, 1.0), (x, 0.0, 0.0), places={"root": (0.0, 0.0, 0.0)})
        for name, x in PAIR.items()
    )
    ends, z = (At("arm", "root"), At("base", "root")), (0.0, 0.0, 1.0)
    held = {
        "revolute": joints.Revolute("joint", *ends, axis=(1.0, 0.0, 0.0)),
        "prismatic": joints.Prismatic("joint", ends[0], direction=(1.0, 0.0, 0.0), to=ends[1]),
        "cylindrical": joints.Cylindrical("joint", ends[0], axis=(1.0, 0.0, 0.0), to=ends[1]),
    }[kind]
    turn = joints.DrivenAngle(
        "turn",
        At("base", "root"),
        lambda t: 0.5 * np.pi * t**3 * (10.0 - 15.0 * t + 6.0 * t**2),
        axis=z,
    )
    spindle, down = (
        joints.Revolute("spindle", At("base", "root"), axis=z),
        loads.Gravity((0.0, 0.0, -10.0)),
    )
    stay = springs.SpringDamper("stay", ends[0], ends[1], stiffness=1e5, length=0.0)
    system = eliminate(
        assemble(
            [base, arm],
            [spindle, turn, held],
            [down, stay],
            outputs={"joint": probes.Reaction("joint")},
        )
    )
    found = integrate(system, GeneralizedAlpha(2e-3), 1.0)
    np.testing.assert_allclose(moment_on(system, found), [0.0, -20.0, 0.0], atol=0.05)


@pytest.mark.parametrize(
    "form", [eliminate, lambda system: system], ids=["eliminated", "multipliers"]
)
def test_hanging_beam(form: Callable[[System], System]) -> None:
    beam = body.cable(
        "beam", models.segment(10, end=(0, -1, 0)), sections.Given(EA=1e5, EI=1.0, rhoA=2.0), dim=2
    )
    system = form(
        assemble([beam], [joints.Clamp("top", At("beam", "left"))], [loads.Gravity((0, -9.81))])
    )
    forces = reactions(solve_statics(system, 1, TIGHT))
    assert forces["top", "y"][-1] == pytest.approx(2 * 9.81, rel=1e-10)
    assert forces["top", "x"][-1] == pytest.approx(0.0, abs=1e-9)


def test_redundant_joints_share_the_force() -> None:
    """Two pins at one place: the motion of one, and together its force."""
    beam = body.cable("beam", models.segment(8), models.SECTION, models.MATERIAL, dim=2)
    end, down = At("beam", "left"), [loads.Gravity((0, -9.81))]
    with pytest.warns(Notice, match="redundant"):
        double = eliminate(assemble([beam], [joints.Pin("a", end), joints.Pin("b", end)], down))
    single = eliminate(assemble([beam], [joints.Pin("a", end)], down))
    two, one = (
        integrate(system, GeneralizedAlpha(1e-3), 0.1, TIGHT) for system in (double, single)
    )
    np.testing.assert_array_equal(two.x, one.x)
    both, alone = reactions(two), reactions(one)
    for axis in "xy":
        np.testing.assert_allclose(both["a", axis] + both["b", axis], alone["a", axis], atol=1e-9)


def test_the_force_of_a_slider_is_along_the_direction_that_stands_beside_its_column() -> None:
    """A weight of 2 kg on a rail that is flat, and on one that rises by 45 degrees."""
    masses = [
        body.point_mass("low", 2.0, np.zeros(2)),
        body.point_mass("high", 2.0, np.array([0.0, 1.0])),
    ]
    rails = [
        joints.Slider("flat", At("low", "center"), (1.0, 0.0)),
        joints.Slider("steep", At("high", "center"), (1.0, 1.0)),
    ]
    held = {rail.name: probes.Reaction(rail.name) for rail in rails}
    system = eliminate(assemble(masses, rails, [loads.Gravity((0.0, -10.0))], outputs=held))
    assert probes.column_labels(system.outputs) == {
        "flat_normal_1": "force along y",
        "steep_normal_1": "force along (-0.7071, 0.7071)",
    }
    found = outputs(integrate(system, GeneralizedAlpha(1e-3), 2e-3))
    assert found["flat_normal_1"][-1] == pytest.approx(20.0)
    assert found["steep_normal_1"][-1] == pytest.approx(20.0 * np.sqrt(0.5))


# ------------------------------------------------------------------------------------------------------------- edges that meet
def pinched(force: float, move: float, order: int = 1) -> dict[str, np.ndarray]:
    """An eighth of a pinched cylinder (R 300, t 3, E 3e6) of splines, its nodes moved by `move` of
    the radius; its reactions.
    """
    random = np.random.default_rng(2)

    def position(phi: np.ndarray, y: np.ndarray) -> np.ndarray:
        places = 300.0 * np.stack([np.sin(phi), y, np.cos(phi)], -1)
        return places + 300.0 * move * random.uniform(-1.0, 1.0, places.shape)

    shape = statics_shells.interpolated(
        position, (np.linspace(0.0, 0.5 * np.pi, 4), np.linspace(0.0, 1.0, 3))
    )
    body = plate("plate", shape, 3.0, sections.Material(3e6, 1.0, 0.3))
    held = [*statics_shells.EIGHTH, statics_shells.DIAPHRAGM][::order]
    load = [loads.PointForce("P", At("plate", "corner_00"), (0.0, 0.0, force))]
    seen = {one.name.replace(" ", ""): probes.Reaction(one.name) for one in held}
    return outputs(solve_statics(eliminate(assemble([body], held, load, outputs=seen)), 1, TIGHT))


@pytest.mark.parametrize("move", [0.0, 1e-13, 1e-10])
def test_edges_that_meet_carry_nothing_without_a_load(move: float) -> None:
    """Their redundant rows have singular values of round-off; E t R^2 is 8e11 N m, and 6e7 N m came
    of nothing.
    """
    assert (
        max(float(np.abs(values).max()) for values in pinched(0.0, move).values())
        < 1e-11 * 3e6 * 3 * 300**2
    )


def test_edges_that_meet_share_what_they_carry() -> None:
    """In whichever order they come, and with nodes moved by 1e-10 of the radius: forces and moments
    to 1e-5 of the load.
    """
    found, moved, other = pinched(-25.0, 0.0), pinched(-25.0, 1e-10), pinched(-25.0, 0.0, -1)
    for name, values in found.items():
        np.testing.assert_allclose(other[name][-1], values[-1], atol=2.5e-4 * 300)
        np.testing.assert_allclose(moved[name][-1], values[-1], atol=2.5e-4 * 300)
    np.testing.assert_allclose(
        sum(values[-1] for name, values in found.items() if name.endswith("_z")), 25.0, atol=1e-4
    )


def test_edges_that_nearly_contradict_each_other_are_named() -> None:
    """Where rows that differ by 1e-9 counted as independent, forces would come of nothing: an error
    names their joint.
    """
    from fmbs_skfem.core.errors import SolverError
    from fmbs_skfem.dynamics import recovery
    from fmbs_skfem.systems import assembly

    shape = statics_shells.rectangle("nurbs", 2, 2, 1.0, 1.0)
    body = plate("plate", shape, 0.01, sections.Material(1e9, 1.0, 0.3))
    whole = assemble(
        [body], [joints.Edge("a", "plate", ("left",)), joints.Edge("b", "plate", ("bottom",))]
    )
    rows, A, _ = assembly.linear_part(whole)
    twice = csr_array(vstack([A, A[[0]] + 1e-9 * A[[3]]]))
    C = csr_array(np.linalg.pinv(twice.toarray(), rcond=0.0))
    recovery.require_none_without_load(
        whole, rows, A, csr_array(np.linalg.pinv(A.toarray(), rcond=1e-6))
    )
    with pytest.raises(SolverError, match=r"held edges 'a'.*: expected no forces without a load"):
        recovery.require_none_without_load(whole, np.append(rows, rows[0]), twice, C)
