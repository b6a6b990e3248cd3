"""Parts in hard cases: turned half round, of different sizes, held everywhere, beside their full
twins, two hundred of them.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fmbs_skfem.bodies import Body, Circular, Material, Rim, cable
from fmbs_skfem.bodies.body import point_mass, reference_at
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics import (
    GeneralizedAlpha,
    Newton,
    Trajectory,
    integrate,
    integration,
    outputs,
)
from fmbs_skfem.dynamics.equilibria.statics import solve_statics
from fmbs_skfem.dynamics.outputs import lifted
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts import departures
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.parts.excitation import Excitation, excite
from fmbs_skfem.scenes import build, reading
from fmbs_skfem.studies.parts import at_place
from fmbs_skfem.systems import At, Motion, System, assemble, check_system, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from fmbs_skfem.systems.system import linear_part
from tests import models
from tests.clocks import wind
from verification.plates import rectangle
from verification.vibration import ring

from .test_part_files import SCENE, alone, arm, unknown

SCHEME, SHARP = GeneralizedAlpha(1e-3), Newton(tolerance=1e-12)
HALF = np.diag([-1.0, -1.0, 1.0])
DOWN = loads.Gravity((0.0, 0.0, -9.81))


def run(system: System, duration: float = 0.4, scheme: GeneralizedAlpha = SCHEME) -> Trajectory:
    return integrate(eliminate(system), scheme, duration, SHARP)


def apart(one: Trajectory, other: Trajectory) -> float:
    """Largest distance of the free ends [m]."""
    first, second = (
        np.stack([outputs(motion)[f"free_{axis}"] for axis in "xyz"]) for motion in (one, other)
    )
    return float(np.linalg.norm(first - second, axis=0).max())


def folded(body: Body) -> System:
    """Two arms that point away from each other along x: the second is the first turned half round."""
    bodies = [parts.placed(body, "I"), parts.placed(body, "II", rotation=HALF)]
    held = [joints.Pin("A", At("I", "right")), joints.Pin("B", At("I", "left"), At("II", "left"))]
    return assemble(bodies, held, [DOWN], outputs={"free": probes.Position(At("II", "right"))})


def test_a_part_turned_half_round() -> None:
    assert apart(run(folded(arm())), run(folded(alone().body))) < 1.5e-4


@cache
def needle() -> Body:
    """A body of two centimetres."""
    return cable(
        "needle", models.segment(8, end=(0.02, 0.0, 0.0)), Circular(2e-4), Material(1e9, 1800.0)
    )


def test_two_parts_of_different_scale() -> None:
    small = part_files.train(
        needle(), excite(needle(), Excitation(runs=2, step=2e-4, duration=0.2))
    ).body

    def hung(large: Body, tiny: Body) -> System:
        bodies = [parts.placed(large, "I"), parts.placed(tiny, "II", np.array([1.0, 0.0, 0.0]))]
        held = [
            joints.Pin("A", At("I", "left")),
            joints.Pin("B", At("I", "right"), At("II", "left")),
        ]
        return assemble(bodies, held, [DOWN], outputs={"free": probes.Position(At("II", "right"))})

    full, reduced = (
        run(hung(*pair), 0.2, GeneralizedAlpha(5e-4))
        for pair in ((arm(), needle()), (alone().body, small))
    )
    assert (
        full.statistics.halved == reduced.statistics.halved == 0
    )  # the needle swings fast: steps of 1 ms are divided
    assert apart(full, reduced) < 1e-4


def test_a_part_beside_its_full_twin() -> None:
    """Both are welded into one beam, part first or last: it moves as two full ones. The training
    alone bent its ends by moments.
    """

    def beam(first: Body, second: Body) -> System:
        bodies = [parts.placed(first, "I"), parts.placed(second, "II", np.array([1.0, 0.0, 0.0]))]
        held = [
            joints.Pin("A", At("I", "left")),
            joints.Weld("W", At("I", "right"), At("II", "left")),
        ]
        return assemble(bodies, held, [DOWN], outputs={"free": probes.Position(At("II", "right"))})

    wanted = run(beam(arm(), arm()))
    part = alone().body
    for pair in ((part, arm()), (arm(), part), (part, part)):
        reduced = run(beam(*pair))
        assert apart(wanted, reduced) < 1e-4
        assert departures.find(reduced) == []


@cache
def washer() -> Body:
    """A ring in space whose rims are rigid frames: nothing has a mass along their third axes."""
    steel = Material(young_modulus=2e8, density=1000.0, poisson_ratio=0.3)
    rims = {"hub": Rim(("inner",)), "edge": Rim(("outer",))}
    return plate("washer", ring(0.1, 0.3, 8), 5e-3, steel, dim=3, rims=rims)


def test_rims_and_frames_without_mass_in_space() -> None:
    """Two rings, edge on hub by a weld, the first hinged at its hub and turned by a moment: parts
    that were trained alone.
    """
    part = part_files.train(
        washer(),
        excite(washer(), Excitation(runs=2, step=2e-3, duration=0.1, samples=25)),
        1e-10,
        None,
        1e-3,
    )
    frame = washer().frames["hub"]
    assert washer().mass.diagonal()[frame + 3] <= 1e-12 * washer().mass.diagonal().max()

    def stack(body: Body) -> System:
        bodies = [parts.placed(body, "I"), parts.placed(body, "II")]
        held = [
            joints.Revolute("A", At("I", "hub"), axis=(0.0, 1.0, 0.0)),
            joints.Weld("W", At("I", "edge"), At("II", "hub")),
        ]
        turn = loads.Moment("turn", At("II", "edge"), (0.0, 2.0, 0.0))
        return assemble(bodies, held, [turn], outputs={"free": probes.Slope(At("II", "edge"))})

    check_system(eliminate(stack(part.body)))
    wanted, reduced = run(stack(washer()), 0.1), run(stack(part.body), 0.1)
    axis = np.stack([outputs(wanted)[f"free_{axis}"] for axis in "xyz"])
    assert np.linalg.norm(axis[:, -1] - axis[:, 0]) > 0.05
    assert apart(wanted, reduced) < 0.02 * np.linalg.norm(axis - axis[:, :1], axis=0).max()


def test_parts_whose_places_are_on_a_line_are_not_turned_about_it() -> None:
    """Those that stand as in their training, or turned with their line alone, are found; others are
    refused.
    """
    sheet = plate(
        "sheet", rectangle("bfs", 2, 2, 0.4, 0.2), 3e-3, Material(2e9, 1200.0, 0.3), dim=3
    )
    sheet = replace(sheet, places={name: sheet.places[name] for name in list(sheet.places)[:2]})
    line = np.subtract(*(reference_at(sheet, name) for name in sheet.places))
    across = np.cross(line, [0.0, 0.0, 1.0])
    for turn, is_found in (
        (0.0 * line, True),
        (across, True),
        (-4.0 * across, True),
        (line, False),
        (line + across, False),
    ):
        there = parts.placed(
            sheet, "there", np.array([0.3, -0.2, 0.9]), Rotation.from_rotvec(turn).as_matrix()
        )
        if is_found:
            assert_allclose(at_place(sheet, there).reference, there.reference, atol=1e-9)
        else:
            with pytest.raises(InputError, match="name a third place off that line"):
                at_place(sheet, there)


def test_a_part_does_not_stand_for_its_mirror_image() -> None:
    sheet = plate(
        "sheet", rectangle("bfs", 2, 2, 0.4, 0.2), 3e-3, Material(2e9, 1200.0, 0.3), dim=2
    )
    for factors, got in (
        ((1.0, -1.0), "those of its mirror image, which is another part"),
        ((1.0, 1.1), "others"),
    ):
        with pytest.raises(
            InputError,
            match=f"places as far apart as those of the full body, got {got}; train it anew",
        ):
            at_place(sheet, replace(sheet, reference=sheet.reference * factors))


def test_a_part_in_place_of_a_body_takes_its_numbers() -> None:
    other = Material(3.0 * models.MATERIAL.young_modulus, 2.0 * models.MATERIAL.density)
    full = cable("arm", models.segment(16), Circular(3.0 * models.SECTION.diameter), other)
    own = at_place(alone().body, full)
    assert own.cells is not None
    assert full.cells is not None
    assert_allclose(own.cells.section[:2], full.cells.section[:2, :1], rtol=1e-12)
    assert_allclose(own.total_mass, full.total_mass, rtol=1e-9)
    assert_allclose(own.radius, full.radius)


def test_a_part_does_not_stand_for_a_body_of_another_poisson_ratio() -> None:
    """Which no number of the part can change."""
    sheet, other = (
        plate("sheet", rectangle("bfs", 2, 2, 0.4, 0.2), 3e-3, Material(2e9, 1200.0, nu), dim=2)
        for nu in (0.3, 0.4)
    )
    S = parts.shape_functions(
        sheet, sheet.reference[None] * np.linspace(0.9, 1.1, 3)[:, None, None], None, 3
    )
    part = parts.reduced_body(sheet, S)
    assert at_place(part, sheet).total_mass == pytest.approx(sheet.total_mass)
    with pytest.raises(
        InputError,
        match=r"numbers of the full body, got Poisson's ratio 0\.3 in place of 0\.4, membrane .* anew",
    ):
        at_place(part, other)


def test_joints_at_places_that_a_part_does_not_have() -> None:
    with pytest.raises(InputError, match=r"one of its points \(left, right\), got 'middle'"):
        assemble([alone().body], [joints.Pin("A", At("arm", "middle"))])


def test_edges_of_parts_are_not_held() -> None:
    """A clamped edge asks for more than the functions of a part can give: the part would stand
    still, without a word.
    """
    sheet = plate(
        "sheet", rectangle("bfs", 2, 2, 0.4, 0.2), 3e-3, Material(2e9, 1200.0, 0.3), dim=3
    )
    S = parts.shape_functions(
        sheet, sheet.reference[None] * np.linspace(0.9, 1.1, 3)[:, None, None], None, 3
    )
    for joint in (
        joints.Edge("held", "sheet", ("left",), slope="xyz"),
        joints.RimNodes("held", "sheet", ("left",), (0.0, 0.0, 1.0)),
    ):
        assemble([sheet], [joint])
        with pytest.raises(InputError, match=r"'held'.*a full body, got 'sheet', a reduced part"):
            assemble([parts.reduced_body(sheet, S)], [joint])


def test_a_part_that_its_joints_hold_everywhere() -> None:
    """Two functions, held at both ends, are at rest; two clamps ask for more directions than there
    are, and leave none.
    """
    states = alone().body.spread @ np.ones(alone().body.spread.shape[1])  # type: ignore[union-attr]
    assert len(states) == len(arm().reference)
    S = parts.with_places(arm(), np.column_stack([arm().constant, arm().reference[:, 0]]))
    stiff = parts.reduced_body(arm(), S)
    held = [joints.Pin("A", At("arm", "left")), joints.Pin("B", At("arm", "right"))]
    system = eliminate(assemble([stiff], held, [DOWN]))
    assert (
        system.size == 0
        or np.abs(integrate(system, SCHEME, 0.01, SHARP).x - system.x0).max() < 1e-9
    )


def test_strains_outside_are_told_with_time_place_and_remedy() -> None:
    bob, spin = (
        point_mass("bob", 5.0, np.array([3.0, 0.0, 0.0])),
        Motion(angular_velocity=(0.0, 0.0, 30.0)),
    )
    shift = np.array([2.0, 0.0, 0.0])
    held = [joints.Pin("A", At("arm", "left")), joints.Pin("B", At("arm", "right"), At("bob"))]
    start = Motion((0.0, -60.0, 0.0), spin.angular_velocity)
    system = assemble(
        [parts.placed(unknown(alone().body), "arm", shift), bob],
        held,
        initial={"arm": start, "bob": start},
    )
    with pytest.warns(
        UserWarning,
        match=r"axial strain .* near \(.*, 0, 0\) m .* since .* s, .*\(fmbs part train --alone\)",
    ):
        motion = run(system, 0.05)
    (one, *_) = departures.find(motion)
    assert 2.0 < one.place[0] < 3.0
    old = replace(alone().body, shapes=replace(alone().body.shapes, positions=np.zeros((0, 0))))  # type: ignore[type-var]
    assert parts.placed(old, "arm", shift).shapes.positions.size == 0  # type: ignore[union-attr]


def test_many_strains_outside_are_summed_up_in_two_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first that leaves its training is told at once, all others at the end: one arm turns
    fast, two are pulled ever more.
    """
    look_often(monkeypatch)
    bodies = [
        parts.placed(unknown(alone().body), f"{k}", np.array([0.0, 2.0 * k, 0.0])) for k in range(3)
    ]
    held = [joints.Pin(f"A{k}", At(f"{k}", "left")) for k in range(3)]
    pulls = [
        loads.PointForce(
            f"pull{k}", At(f"{k}", "right"), (force, 0.0, 0.0), lambda t: 100.0 * t * t
        )
        for k, force in ((0, 1e3), (1, 2e3))
    ]
    turns = {"2": Motion((240.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 60.0))}
    with pytest.warns(Notice) as shown:
        motion = integrate(
            eliminate(assemble(bodies, held, pulls, initial=turns)), SCHEME, 0.1, SHARP
        )
    told, found = (
        [str(one.message) for one in shown if one.category is Notice],
        departures.find(motion),
    )
    assert [one.body for one in sorted(found, key=lambda one: one.time)] == ["2", "1", "0"]
    assert len(told) == 2
    assert told[0].startswith("part '2': ")
    assert "outside as well" not in told[0]
    first, *others = sorted(found, key=lambda one: -one.excess)
    assert f"part '{first.body}': {first.kind} {first.value:.3g}" in told[1]
    assert (
        f"; outside as well: parts {', '.join(repr(one.body) for one in others)}; its error"
        in told[1]
    )


@pytest.mark.parametrize("tick", [0.0, integration.PACE, 100.0])
def test_warnings_of_departures_do_not_depend_on_the_clock(
    tick: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A slow machine shows a run often, a fast one once: both warn after LOOK states, and at the
    end.
    """
    look_often(monkeypatch, tick)
    bodies = [
        parts.placed(unknown(alone().body), f"{k}", np.array([0.0, 2.0 * k, 0.0])) for k in range(2)
    ]
    held = [joints.Pin(f"A{k}", At(f"{k}", "left")) for k in range(2)]
    pull = loads.PointForce("pull", At("0", "right"), (1e3, 0.0, 0.0), lambda t: 100.0 * t * t)
    turns = {"1": Motion((120.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 60.0))}
    with pytest.warns(Notice) as shown:
        integrate(eliminate(assemble(bodies, held, [pull], initial=turns)), SCHEME, 0.1, SHARP)
    first, last = (str(one.message) for one in shown if one.category is Notice)
    assert first.startswith("part '1': ")
    assert "part '0'" not in first
    assert "part '0'" in last


def look_often(patch: pytest.MonkeyPatch, tick: float = integration.PACE) -> None:
    """Runs show their states as often as a machine does on which a moment takes `tick` seconds, and
    looks take few of them.
    """
    patch.setattr(departures, "LOOK", 10)
    wind(patch, integration, tick=tick)


def test_a_caller_that_takes_warnings_for_errors_stops_the_run_when_strains_leave_the_training(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    look_often(monkeypatch)
    spin = Motion(angular_velocity=(0.0, 0.0, 60.0))
    system = assemble(
        [unknown(alone().body)], [joints.Pin("A", At("arm", "left"))], initial={"arm": spin}
    )
    reached: list[float] = []
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        with pytest.raises(UserWarning, match="outside since"):
            integrate(eliminate(system), SCHEME, 10.0, SHARP, progress=reached.append)
    assert reached[-1] < 0.1


def test_equilibria_outside_of_the_training_are_told() -> None:
    held, pull = (
        [joints.Pin("A", At("arm", "left"))],
        loads.PointForce("pull", At("arm", "right"), (1000.0, 0.0, 0.0)),
    )
    with pytest.warns(UserWarning, match="part 'arm': axial strain"):
        solve_statics(eliminate(assemble([unknown(alone().body)], held, [pull])), 2)


def test_scenes_of_another_dimension_are_refused(tmp_path: Path) -> None:
    part_files.save(alone(), tmp_path / "arm.part.h5")
    text = SCENE.format(dimension=2, place="left").replace(
        "[1 m, 0, 0], rotation: {axis: [0, 0, 1], angle: 90 deg}", "[1 m, 0]"
    )
    text = text.replace("[0, 0, -9.81 m/s^2]", "[0, -9.81 m/s^2]").replace("spherical", "pin")
    with pytest.raises(
        InputError, match="a part of dimension 2, got 3; train it in a scene of dimension 2"
    ):
        build.system(reading.loads(text, tmp_path))


def test_many_parts_cost_no_more_each_than_few() -> None:
    """Rows of joints at places are entries of an identity: what is left out leaves one entry a
    coordinate.
    """

    def chain(count: int) -> System:
        bodies = [
            parts.placed(alone().body, f"arm{k}", np.array([float(k), 0.0, 0.0]))
            for k in range(count)
        ]
        held = [joints.Pin("root", At("arm0", "left"))]
        held += [
            joints.Pin(f"j{k}", At(f"arm{k - 1}", "right"), At(f"arm{k}", "left"))
            for k in range(1, count)
        ]
        return assemble(bodies, held, [DOWN], pictures=False)

    full = chain(200)
    free = eliminate(full)
    assert linear_part(full)[1].nnz <= 2.0 * 3 * 200
    assert free.lift.matrix.nnz <= full.size
    assert free.size == full.size - 600
    assert free.mass.nnz <= 200 * full.mass.nnz / 100


def test_energy_and_angular_momentum_drift_as_those_of_the_full_body() -> None:
    """Second order in the step, and within a fifth of the full body's own drift."""

    def drift(body: Body, h: float) -> tuple[float, float]:
        start = {"arm": Motion((0.3, 0.0, 0.1), (0.5, 4.0, 2.0))}
        system = assemble([body], outputs={"energy": probes.Energy()}, initial=start)
        motion = integrate(system, GeneralizedAlpha(h, rho_inf=1.0), 0.4, SHARP)
        q, rate, _ = lifted(motion)
        angular = np.cross(
            q.reshape(len(q), -1, 3), (rate @ system.mass).reshape(len(q), -1, 3)
        ).sum(axis=1)
        energy = outputs(motion)["energy_balance"]
        return float(np.abs(angular - angular[0]).max() / np.linalg.norm(angular[0])), float(
            np.ptp(energy) / energy[0]
        )

    found = {h: (drift(arm(), h), drift(alone().body, h)) for h in (2e-3, 1e-3)}
    for k in range(2):
        full, part = found[2e-3][0][k], found[2e-3][1][k]
        assert part == pytest.approx(full, rel=0.2)
        assert part / found[1e-3][1][k] == pytest.approx(4.0, abs=0.8)
