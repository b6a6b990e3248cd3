"""When events happen: values at rest at zero, conditions, touches, jumps, and what is no number.

A rod turns on its pin at 4 rad/s, so that its angle is 4 t; exact times are those of the angles.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem.core.errors import InputError, Reason, SolverError
from fmbs_skfem.core.values import conditions
from fmbs_skfem.core.values.responses import of_state
from fmbs_skfem.dynamics import GeneralizedAlpha, Trajectory, integrate
from fmbs_skfem.dynamics.checkpoint import Checkpoint, Resumed, Rows
from fmbs_skfem.dynamics.diagnoses import diagnosis
from fmbs_skfem.systems.forces import loads

from .test_events import ROD, SPIN, event, rod

STEP = 1e-2
TURN = (
    SPIN * STEP
) ** 2 / 10  #: of a time that is that of an angle: the rate of a step is (w h)^2 / 12 off


def run(
    when: str, step: float = STEP, weight: tuple[float, float] = (0.0, 0.0), **more: object
) -> Trajectory:
    """The motion of the rod over 0.2 s, whose pin an event releases: without weight it turns on as
    it did.
    """
    act = {"release": ("pin",)} if not {"stop", "lock"} & set(more) else {}
    return integrate(
        rod({"e": event(when, **(act | more))}, weight=weight), GeneralizedAlpha(step), 0.2
    )


def times(motion: Trajectory) -> list[float]:
    return [one.time for one in motion.events]


@pytest.mark.parametrize("step", [1e-2, 3.1e-3])
@pytest.mark.parametrize(
    "when, direction, angles",
    [
        ("angle > 0.3", "both", [0.3]),
        ("angle > 0.3", "rising", [0.3]),
        ("angle > 0.3", "falling", []),
        ("angle < 0.3", "both", [0.3]),
        ("angle > 0", "both", [0.0]),
        ("angle < 0", "both", []),
        ("max(angle - 0.3, 0)", "both", [0.3]),
        ("max(0.3 - angle, 0)", "both", [0.3]),
        ("max(0.3 - angle, 0)", "rising", []),
        ("where(angle < 0.3, 0, -5)", "falling", [0.3]),
        ("(angle > 0.2) * (angle < 0.4)", "both", [0.2, 0.4]),
        ("1 - (angle > 0.2) * (angle < 0.4)", "rising", [0.4]),
        ("max((angle > 0.2) * (angle < 0.4), angle > 0.6)", "rising", [0.2, 0.6]),
        ("sign(angle - 0.3) + 1", "both", [0.3]),
        ("floor(angle / 0.3)", "rising", [0.3]),
    ],
)
def test_a_value_at_rest_at_zero_crosses_it_where_it_leaves(
    when: str, direction: str, angles: list[float], step: float
) -> None:
    """And one that jumps to zero where it jumps, neither at the end of its step nor at the begin."""
    assert_allclose(
        times(run(when, step, direction=direction)),
        np.array(angles) / SPIN,
        rtol=(SPIN * step) ** 2 / 10,
        atol=1e-9,
    )


@pytest.mark.parametrize(
    "when, direction, angles",
    [
        ("abs(angle - 0.3)", "both", [0.3]),
        ("abs(angle - 0.3)", "falling", [0.3]),
        ("abs(angle - 0.3)", "rising", []),
        ("-abs(angle - 0.3)", "rising", [0.3]),
        ("(angle - 0.3)**2", "both", [0.3]),
        ("abs(angle - 0.3) + 1e-4", "both", []),
        ("(angle - 0.3)**2 + 1e-5", "both", []),
        ("(angle > 0.21) * (angle < 0.22)", "rising", [0.21]),
        (
            "angle > 0.21 + 100 * (angle - 0.22)**2 + 0.008",
            "both",
            [0.22 - 0.01 * (np.sqrt(1.25) - 0.5), 0.22 + 0.01 * (np.sqrt(0.45) - 0.3)],
        ),
        ("abs(tip.x - 0.25)", "both", [0.25268025514207865]),
        ("abs(angle - 0.303) * exp(angle)", "both", [0.303]),
        ("max(0.303 - angle, 2 * (angle - 0.303))", "falling", [0.303]),
        ("abs(angle - 0.303) + 1e-7", "both", []),
        ("(angle - 0.303)**2 + 1e-7", "both", []),
    ],
)
def test_values_that_touch_zero_and_conditions_that_hold_for_less_than_a_step(
    when: str, direction: str, angles: list[float]
) -> None:
    if "100 *" in when:  # angle - 0.218 - 100 (angle - 0.22)^2 = 0
        angles = sorted(float(one.real) + 0.22 for one in np.roots([-100.0, 1.0, 0.002]))
    assert_allclose(times(run(when, direction=direction)), np.array(angles) / SPIN, rtol=TURN)


@pytest.mark.parametrize("step", [1e-2, 3e-4])
@pytest.mark.parametrize("place", [0.0, 1e-10, 1e-7, 1e-4, 5e-4, 0.3, 1.0 - 5e-4, 1.0 - 1e-7])
def test_values_touch_zero_wherever_in_a_step(place: float, step: float) -> None:
    """Also at its ends, and next to them, and where they leave zero three times as fast."""
    at = (31 + place) * step
    told = f"abs(t - {at!r})", f"(t - {at!r})**2", f"max({at!r} - t, 3 * (t - {at!r}))"
    for when in told:
        system = rod({"e": event(when, release=("pin",))}, weight=(0.0, 0.0))
        motion = integrate(system, GeneralizedAlpha(step), 34 * step)
        assert_allclose(times(motion), [at], atol=2e-5 * step)


def test_what_is_zero_until_a_load_begins() -> None:
    """At the instant at which the load begins, inside of a step, and at the start where it begins
    there.
    """
    for begin in (0.0513, 0.05, 0.0):
        push = loads.PointForce(
            "push", ROD, (1.0, 0.0), lambda t, begin=begin: np.where(t > begin, 5.0, 0.0)
        )
        system = rod(
            {"e": event("angle", release=("pin",))}, weight=(0.0, 0.0), spin=0.0, pushed=[push]
        )
        assert_allclose(times(integrate(system, GeneralizedAlpha(1e-2), 0.2)), [begin], atol=1e-8)


def test_what_a_lock_holds_at_zero_is_not_at_rest_there() -> None:
    """A brake stops the rod; when it lets go, the rate leaves zero: the brake does not close again,
    one that jumped does.
    """
    told = {
        "brake": event("rate", lock=("pin",)),
        "go": event("t - 0.5", release=("pin",)),
        "again": event("t - 0.5", lock=("latch",)),
    }
    del told["again"]
    motion = integrate(rod(told, weight=(0.0, -50.0)), GeneralizedAlpha(2e-3), 0.8)
    assert [one.name for one in motion.events] == ["brake", "go"]
    told["brake"] = event("where(t < 0.1, 1, 0) + where(t > 0.6, 1, 0)", lock=("pin",))
    motion = integrate(rod(told, weight=(0.0, -50.0)), GeneralizedAlpha(2e-3), 0.8)
    assert [(one.name, round(one.time, 9)) for one in motion.events] == [
        ("brake", 0.1),
        ("go", 0.5),
        ("brake", 0.6),
    ]


def test_a_value_that_reads_a_reaction_or_an_energy_may_be_zero_for_long() -> None:
    kick = loads.PointForce("kick", ROD, (3.0, 0.0), lambda t: np.where(t > 0.0513, 1.0, 0.0))
    for when in ("abs(pin.x) > 0.1", "max(abs(pin.x) - 0.1, 0)", "E.kinetic > 0", "E.kinetic"):
        system = rod({"e": event(when, stop=True)}, weight=(0.0, 0.0), spin=0.0, pushed=[kick])
        assert_allclose(times(integrate(system, GeneralizedAlpha(1e-2), 0.2)), [0.0513], atol=1e-6)


@pytest.mark.parametrize(
    "when, angle, happens",
    [
        ("sqrt(angle - 0.3)", 0.0, []),
        ("sqrt(0.3 - angle) + 1", 0.3, []),
        ("sqrt(0.3 - angle) > 2", 0.3, []),
        ("log(0.3 - angle) + 20", 0.3, [0.3]),
        ("log(0.3 - angle) + 3", 0.3, [0.3 - np.exp(-3)]),
    ],
)
def test_what_is_no_number_ends_the_run(when: str, angle: float, happens: list[float]) -> None:
    """With place and time, and the motion up to there; what crosses zero before it in the same step
    happens.
    """
    with pytest.raises(
        SolverError,
        match=r"event 'e': 'when' is no number \(nan\) at t = .* s; guard it with where",
    ) as caught:
        run(when)
    error = caught.value
    assert error.reason is Reason.NOT_FINITE
    assert error.time == pytest.approx(angle / SPIN, rel=TURN)
    assert (error.partial is None) == (angle == 0.0)
    if error.partial is not None:
        assert_allclose(times(error.partial), np.array(happens) / SPIN, rtol=TURN)
    found = diagnosis.explain(error)
    assert [(one.name, one.what) for one in found.causes] == [
        ("signal", str(error).partition(";")[0])
    ]
    assert found.causes[0].remedy == "guard it with where(...)"


def test_no_number_behind_an_event_that_ends_the_run_or_happens_once() -> None:
    assert_allclose(times(run("log(0.3 - angle) + 20", stop=True)), [0.075], rtol=TURN)
    assert_allclose(
        times(run("log(0.3 - angle) + 3", once=True)), [(0.3 - np.exp(-3)) / SPIN], rtol=TURN
    )
    assert_allclose(
        times(run("where(angle < 0.3, sqrt(max(0.3 - angle, 0)), -1)")), [0.075], rtol=TURN
    )
    assert times(run("(angle > 9) * (sqrt(0.3 - angle) > 2)")) == []
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        assert len(run("log(angle) + 1").events) == 1  # -inf at the start


def test_resumed_runs_know_what_is_at_rest() -> None:
    """Conditions that hold for less than a step directly behind a checkpoint among them."""
    system = rod(
        {
            "e": event("(angle > 0.21) * (angle < 0.22)", release=("pin",)),
            "f": event("angle > 0.5", stop=True),
        },
        weight=(0.0, 0.0),
    )
    found: list[tuple[Rows, Checkpoint]] = []
    scheme = GeneralizedAlpha(1e-3)
    motion = integrate(
        system,
        scheme,
        0.2,
        record=lambda moment: found.append((moment.rows(0, moment.kept), moment.checkpoint())),
    )
    assert [one.name for one in motion.events] == ["e", "e", "f"]
    for rows, held in found:
        assert integrate(system, scheme, 0.2, resume=Resumed(held, rows)).events == motion.events


@pytest.mark.parametrize(
    "text, margin",
    [
        ("a.x < 1 mm", "(1 mm - a.x)"),
        (
            "(a > -2) * (b <= 3 m) + (c >= d**2)",
            "max(min((a - (-(2.0))), (3 m - b)), (c - (d ** 2.0)))",
        ),
        (
            "min(sin(a) > 1, b < where(a > 0, 2, pull(t)))",
            "min((sin(a) - 1.0), (where((a > 0.0), 2.0, pull(t)) - b))",
        ),
        ("a - 1", None),
        ("(a < 1) - (b > 2)", None),
        ("(a < 1) * b", None),
    ],
)
def test_margins_of_conditions(text: str, margin: str | None) -> None:
    found = conditions.margin_of(of_state(text))
    assert (found and found.text) == margin


def test_margins_that_are_too_long_are_none() -> None:
    long = "a" + "".join(f" + {k}.123456789" for k in range(1, 125))
    assert conditions.margin_of(of_state(f"{long} > 1")) is None


@pytest.mark.parametrize("when", ["1", "0.3 m", "2 > 1"])
def test_what_never_changes_is_refused(when: str) -> None:
    with pytest.raises(
        InputError,
        match=r"event 'e'.when: expected an expression of outputs or t, which crosses zero, got '.*'",
    ):
        rod({"e": event(when, stop=True)})
