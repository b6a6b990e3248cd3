"""A failed solve says why: ten ways to fail, each with the cause that was built in and the facts
that show it.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array

from fmbs_skfem import reduction, scenes
from fmbs_skfem.bodies import body, rigid, sections
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.contact import contacts
from fmbs_skfem.core.errors import Reason, SolverError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate, solve_statics
from fmbs_skfem.dynamics.diagnoses import diagnosis, stopped
from fmbs_skfem.dynamics.diagnoses.diagnosis import Diagnosis
from fmbs_skfem.dynamics.integration import HALVINGS, FailedStep
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import nurbs
from fmbs_skfem.systems import At, Motion, System, assemble, compile_system, eliminate
from fmbs_skfem.systems import compiled as compilation
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from verification.statics import truss

from .. import models

END, STEP = At("beam", "left"), GeneralizedAlpha(1e-3)
History = Callable[[np.ndarray], np.ndarray]


def beam() -> body.Body:
    return body.cable("beam", models.segment(8), models.SECTION, models.MATERIAL, dim=2)


def pushed(history: History) -> System:
    """Cantilever under a transverse force of 1 N times `history` at its tip."""
    force = loads.PointForce("push", At("beam", "right"), (0.0, 1.0), history)
    return eliminate(assemble([beam()], [joints.Clamp("clamp", END)], [force]))


def huge_load() -> object:
    """The force grows e-fold every 2.5 ms."""
    return integrate(pushed(lambda t: np.exp(400 * t)), STEP, 1.0)


def jump() -> object:
    return integrate(pushed(lambda t: np.where(t < 0.0055, 1.0, 1e12)), STEP, 0.01)


def large_step() -> object:
    """Example 2 turns by 9.5 rad in a step; up to 0.75 s its steps find the way in parts."""
    return integrate(models.double_pendulum(8), GeneralizedAlpha(1.25), 5.0)


def signal() -> object:
    return integrate(pushed(lambda t: np.where(t > 0.1005, np.nan, 1.0)), STEP, 1.0)


def contradiction() -> object:
    """A drive that turns a clamped end."""
    held: list[joints.Joint] = [
        joints.Clamp("clamp", END),
        joints.DrivenAngle("drive", END, lambda t: t),
    ]
    return integrate(eliminate(assemble([beam()], held)), STEP, 0.01)


def locked() -> object:
    """Two rigid links of 1 m, whose far end is pulled outwards at 1 m/s: stretched out after
    0.99963 s, within a step.

    No part of a step ends there: whether one that does converges, its last digit decides.
    """
    bodies = [
        body.point_mass("A", 1.0, np.array([1.00037, 0.0])),
        body.point_mass("B", 1.0, np.array([0.500185, np.sqrt(1.0 - 0.500185**2)])),
    ]
    A, B = At("A", "center"), At("B", "center")
    held: list[joints.Joint] = [
        joints.DrivenPosition("pull", A, (lambda t: t, lambda t: 0.0 * t)),
        joints.RigidLink("first", B, (0.0, 0.0)),
        joints.RigidLink("second", A, B),
    ]
    return integrate(assemble(bodies, held), STEP, 2.0)


def stiff_spring() -> object:
    """A wheel of 0.01 kg m^2 that turns at 2 10^5 rad/s against 4 10^8 N m/rad: omega = 2 10^5
    rad/s, 200 in a step.
    """
    wheel = rigid.rigid("wheel", 1.0, np.array(0.01), (0.0, 0.0), dim=2)
    spring = loads.TorsionSpring("spring", At("wheel", "frame"), stiffness=4e8)
    motion = {"wheel": Motion(angular_velocity=200_000.0)}
    return integrate(
        assemble([wheel], [joints.Revolute("pin", At("wheel", "frame"))], [spring], initial=motion),
        STEP,
        0.1,
    )


def buckling() -> object:
    """The truss of von Mises under load control with few iterations: the limit load is 0.475 of the
    load.
    """
    return solve_statics(truss(load=8.0), 20, Newton(iterations=2))


@functools.cache
def trained() -> System:
    """Example 2 over 1 s in the modes of its own motion."""
    full = models.double_pendulum(8, all_multipliers=True)
    data = reduction.snapshots(
        integrate(eliminate(full), GeneralizedAlpha(1e-3), 1.0, Newton(1e-12), 5)
    )
    parts = reduction.body_level(full)
    return reduction.reduce_system(full, parts, reduction.bases(full, data, parts, 1e-10))


def outside() -> object:
    """Gravity turned round and 20 000 times as strong, and where it has bent the beams by then, few
    iterations.
    """
    model = trained()
    loaded = replace(model, loads=replace(model.loads, constant=-2e4 * model.loads.constant))
    bent = integrate(loaded, GeneralizedAlpha(1e-3), 0.01).x[-1]
    return integrate(replace(loaded, x0=bent), GeneralizedAlpha(1e-2), 1.0, Newton(iterations=3))


def indefinite() -> object:
    """A beam that begins at 0.4 of its length."""
    model = pushed(lambda t: 0.0 * t)
    return integrate(replace(model, x0=0.4 * model.x0), GeneralizedAlpha(5e-3), 0.1)


def limp() -> object:
    """A helix of two turns, pressed together by 100 N: nothing but tension would hold its curvature
    in its plane.
    """
    s = np.linspace(0.0, 1.0, 25)
    helix = np.column_stack([0.05 * np.cos(4 * np.pi * s), 0.05 * np.sin(4 * np.pi * s), 0.5 * s])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        part = body.cable(
            "beam", models.polyline(helix), sections.Circular(0.012), sections.Material(2e9, 1200.0)
        )
    push = loads.PointForce("push", At("beam", "right"), (0.0, 0.0, -100.0))
    return integrate(
        eliminate(assemble([part], [joints.Clamp("clamp", END)], [push])),
        GeneralizedAlpha(5e-3),
        0.1,
    )


def massless() -> object:
    """A free point without mass beside a beam."""
    ghost = body.point_mass("ghost", 1.0, np.array([0.0, 1.0]))
    model = assemble([ghost, beam()], [joints.Clamp("clamp", END)], [loads.Gravity((0.0, -9.81))])
    mass = model.mass.tolil()
    mass[0, 0] = mass[1, 1] = 0.0
    return integrate(eliminate(replace(model, mass=csr_array(mass))), STEP, 0.1)


def closure() -> object:
    far = joints.DrivenPosition("drive", END, (lambda t: 0.2 + 0 * t, lambda t: 0 * t))
    return integrate(assemble([beam()], [far]), STEP, 0.01)


def free() -> object:
    return solve_statics(assemble([beam()], [], [loads.Gravity((0.0, -9.81))]))


WAYS: dict[str, tuple[Callable[[], object], Reason | None]] = {
    "huge load": (huge_load, None),
    "jump": (jump, None),
    "large step": (large_step, Reason.DIVERGED),
    "stiff spring": (stiff_spring, None),
    "signal": (signal, Reason.NOT_FINITE),
    "contradiction": (contradiction, Reason.INCONSISTENT),
    "dead centre": (locked, None),
    "buckling": (buckling, Reason.NOT_CONVERGED),
    "outside training": (outside, None),
    "indefinite": (indefinite, None),
    "limp": (limp, None),
    "massless": (massless, Reason.SINGULAR_TANGENT),
    "closure": (closure, Reason.INCONSISTENT),
    "free": (free, Reason.SINGULAR_TANGENT),
}


@functools.cache
def failed(way: str) -> tuple[SolverError, Diagnosis]:
    with pytest.raises(SolverError) as caught:
        WAYS[way][0]()
    return caught.value, diagnosis.explain(caught.value)


def cause(way: str) -> diagnosis.Cause:
    return {one.name: one for one in failed(way)[1].causes}[way]


def test_a_step_that_is_large_from_rest_is_named() -> None:
    """Example 2 as it begins, of which all but the surroundings of the pin falls by g h^2 = 157 m
    in a step.
    """
    with pytest.raises(SolverError) as caught:
        integrate(models.double_pendulum(8), GeneralizedAlpha(4.0), 8.0)
    found = diagnosis.explain(caught.value)
    assert [one.name for one in found.causes] == ["large step"]
    assert "moves the mechanism by 157" in found.causes[0].what
    assert found.way == pytest.approx(9.81 * 4.0**2, rel=0.02)


@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_fail_is_told(way: str) -> None:
    error, found = failed(way)
    assert cause(way).remedy
    assert found.reason is error.reason
    assert WAYS[way][1] in (None, error.reason)
    assert found.at == error.time
    assert found.message == str(error)
    assert (found.good is None) == (error.partial is None)


@pytest.mark.parametrize(
    "way", [way for way in WAYS if way not in ("outside training", "dead centre")]
)
def test_the_first_cause_is_the_one_built_in(way: str) -> None:
    assert failed(way)[1].causes[0].name == way


@pytest.mark.parametrize(
    "way,texts",
    [
        ("huge load", ["loads on beam"]),
        ("jump", ["between t = 0.005 and 0.006 s", "a load on beam jumps from 1 to 1e+12"]),
        ("large step", ["II turns by 9.", "step of 1.25 s"]),
        (
            "stiff spring",
            ["a torsion spring on wheel vibrates with h omega = 200", "step of 0.001 s"],
        ),
        ("signal", ["a load on beam is no finite number at t = 0.101 s"]),
        ("contradiction", ["drive.angle", "ask for different motions"]),
        ("dead centre", ["joint second", "joint first", "joint pull"]),
        ("buckling", ["near load factor 0.47"]),
        ("outside training", ["strains I"]),
        ("indefinite", ["beam is compressed by 42 %"]),
        ("limp", ["beam is curved in space", "only tension holds it", "strains of beam -"]),
        ("massless", ["ghost coordinate 0", "ghost coordinate 1"]),
        ("closure", ["drive.x", "by 0.2"]),
        ("free", ["beam can move freely"]),
    ],
)
def test_causes_hold_names_and_numbers(way: str, texts: list[str]) -> None:
    """(1 - 0.4^2)/2 = 42 %; sqrt(3) of the limit point and the other figures as they were built in."""
    assert all(text in cause(way).what for text in texts)


DIVIDING = """
schema: 1
dimension: 2
bodies: {ball: {type: point_mass, mass: 1 kg, position: [1, 0]}}
loads: {pull: {type: control_force, at: ball, direction: [1, 0], force: "-(1 N m) / LENGTH"}}
analysis: {type: dynamic, duration: 2 s, step: 5 ms}
outputs: {ball: {type: position, at: ball}}
"""


@pytest.mark.parametrize(
    ("length", "last"),
    [("(ball.x - 1 m)", 0.0), ("max(ball.x - 0.5 m, 0)", 0.5 * np.sqrt(0.5 * np.pi))],
)
def test_an_expression_that_divides_by_zero_at_one_state_is_named(length: str, last: float) -> None:
    """At the start, and where the ball comes to: d'' = -(1 m^2/s^2)/d ends from rest at d0 after d0
    sqrt(pi/2) s/m.
    """
    with pytest.raises(SolverError) as caught:
        integrate(
            build.system(scenes.loads(DIVIDING.replace("LENGTH", length))),
            GeneralizedAlpha(5e-3),
            2.0,
        )
    found = diagnosis.explain(caught.value)
    assert found.causes[0].name == "force"
    assert "a load on ball is no finite number near the state at t = " in found.causes[0].what
    assert "a division by zero" in found.causes[0].remedy
    assert found.good == pytest.approx(last, abs=5e-3)


def test_the_locked_links_stop_when_they_are_stretched_out() -> None:
    """Unit rows (1, 0), (1, 0), (1, 0, -1, 0)/sqrt 2 depend on each other with weights 1 : 1 : sqrt
    2.
    """
    found = failed("dead centre")[1]
    assert found.at == pytest.approx(1.0, abs=1e-3)
    assert found.singular is not None
    assert found.singular[1] < 1e-3 * found.singular[0]
    assert dict(found.null) == pytest.approx(
        {"joint second": 0.5, "joint first": 0.25, "joint pull": 0.25, "A": 0.0, "B": 0.0}, abs=1e-4
    )
    assert {name for name, _ in found.multipliers} == {
        "joint second.length",
        "joint first.length",
        "joint pull.x",
        "joint pull.y",
    }


def test_an_attempt_repeats_the_iteration() -> None:
    """All step lengths; the last correction of an iteration that went too far is larger than one
    before it.
    """
    error, found = failed("large step")
    assert isinstance(error, FailedStep)
    assert [attempt.step for attempt in found.attempts] == [
        1.25 / 2**k for k in range(HALVINGS + 1)
    ]
    assert found.step == error.run.done + 1
    for attempt in found.attempts:
        assert len(attempt.corrections) == len(attempt.residuals)
        assert found.good is not None
        assert found.good < attempt.time <= found.good + 1.25 + 1e-12
    diverged = [
        attempt.corrections for attempt in found.attempts if attempt.outcome is Reason.DIVERGED
    ]
    assert diverged
    assert all(last > min(before) for *before, last in diverged)
    again = diagnosis.explain(error)
    assert again.attempts == found.attempts
    assert again.residuals == found.residuals


def test_a_step_that_leaps_in_all_lengths_is_explained() -> None:
    """A beam of 1 m inside of a circle of 1 mm: longer steps are refused since they go through it,
    although Newton converges.
    """
    held, shape = (
        joints.Pin("j", END),
        contacts.ContactSphere("k", body="beam", center=(0.5, 0.0), diameter=1e-3, inside=True),
    )
    line = body.cable("beam", models.segment(5), models.SECTION, models.MATERIAL, dim=2)
    system = eliminate(assemble([line], [held], [loads.Gravity((0.0, -9.81)), shape]))
    with pytest.warns(Notice), pytest.raises(FailedStep) as caught:
        integrate(system, STEP, 0.2)  # when it goes through is a matter of round-off: up to 0.08 s
    found = diagnosis.explain(caught.value)
    assert len(found.attempts) == HALVINGS + 1
    assert found.attempts[-1].outcome is not None


def test_a_large_model_is_explained_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sparse factors: the same rules, and the first and the last of the step lengths."""
    monkeypatch.setattr("fmbs_skfem.systems.layouts.BAND", 20)
    shape = nurbs.surface(*nurbs.rectangle(1.0, 0.5, 6, 4, 2))
    sheet = plate(
        "sheet",
        replace(shape, points={"c": nurbs.place(shape, 1.0, 0.5)}),
        1e-3,
        sections.Material(1e9, 1000.0, 0.3),
    )
    push = loads.PointForce(
        "push", At("sheet", "c"), (0.0, 0.0, 1.0), lambda t: np.where(t < 0.0055, 0.0, 1e12)
    )
    with pytest.raises(SolverError) as caught:
        integrate(assemble([sheet], [], [push]), STEP, 0.01)
    found = diagnosis.explain(caught.value)
    assert caught.value.partial.statistics.solver.startswith("sparse")
    assert (
        found.causes[0].what
        == "between t = 0.005 and 0.006 s a load on sheet jumps from 0 to 1e+12"
    )
    assert [attempt.step for attempt in found.attempts] == pytest.approx(
        [5e-4, 5e-4 / 2**HALVINGS]
    )  # from the jump on
    assert all(attempt.corrections for attempt in found.attempts)


def test_residuals_are_forces_in_newtons() -> None:
    """Multipliers count in full: the largest residual by name is that of the message, in both
    lists.
    """
    error, found = failed("dead centre")
    assert found.residuals[0][0] == error.worst[0][0]
    assert found.residuals[0][1] == pytest.approx(error.worst[0][1], rel=1e-6)


def test_strains_of_a_stretched_beam() -> None:
    """(1.2^2 - 1)/2 everywhere."""
    model = pushed(lambda t: 0.0 * t)
    assert stopped.strains(model, 1.2 * model.x0)["beam"] == pytest.approx((0.22, 0.22), abs=1e-12)


def test_turns_of_a_spinning_beam() -> None:
    """Every slope of a straight beam turns at the same rate."""
    model = assemble([beam()], [])
    spun = model.x0.reshape(-1, 2) @ np.array([[0.0, 3.0], [-3.0, 0.0]])
    assert stopped.turns(model, model.x0, spun.ravel()) == {"beam": pytest.approx(3.0, rel=1e-12)}


def test_the_stiffest_wave_is_bounded_by_the_longest_cell() -> None:
    """A Rayleigh quotient lies between the lowest and the highest of all frequencies."""
    model = compile_system(pushed(lambda t: 0.0 * t))
    n, none = model.system.size, np.zeros(0)
    x = model.system.x0
    stop = stopped.StoppedSolve(
        model, 0.0, 0.0, 1.0, x, 0 * x, none, x, np.zeros(n), (0.0, 0.0), (0.0, 0.0)
    )
    squares = eigh(
        compilation.tangent(model, x, none).toarray(),
        model.system.mass.toarray(),
        eigvals_only=True,
    )
    assert 0.1 * np.sqrt(squares[-1]) < stopped.stiffest(stop) <= np.sqrt(squares[-1])


def test_a_smooth_signal_is_no_jump() -> None:
    model = compile_system(pushed(lambda t: np.exp(60 * t)))
    x, none = model.system.x0, np.zeros(0)
    stop = stopped.StoppedSolve(
        model, 0.1, 0.101, 1e-3, x, 0 * x, none, x, 0 * x, (0.0, 0.0), (0.0, 0.0)
    )
    assert stopped.jumps(stop) == []


def test_a_limp_cable_is_not_advised_to_take_a_shorter_step() -> None:
    assert not {"large step", "indefinite"} & {one.name for one in failed("limp")[1].causes}
