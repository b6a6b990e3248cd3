"""Modes and buckling of scenes: about loaded and turning states, against exact values, as files,
and what is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice

from ..cli.calls import fmbs

BEAM = """\
schema: 1
name: beam
dimension: {dim}
bodies:
  beam: {{type: cable, mesh: {mesh}, degree: 5, section: {{shape: given, EA: 1e7, EI: 1, rhoA: 1}}}}
joints:
  root: {{type: {joint}, at: beam.left}}
{loads}
analysis: {analysis}
"""
MESH = Path(__file__).parents[2] / "meshes" / "beam_20.msh"


def beam(folder: Path, analysis: str, load: str = "", joint: str = "clamp", dim: int = 2) -> Path:
    (folder / "scenes").mkdir(exist_ok=True)
    (folder / "beam.msh").write_bytes(MESH.read_bytes())
    path = folder / "scenes" / "beam.yaml"
    loads = f"loads:\n  tip: {load}" if load else ""
    path.write_text(
        BEAM.format(dim=dim, mesh="../beam.msh", joint=joint, loads=loads, analysis=analysis)
    )
    return path


def test_modes_are_those_of_the_loaded_state(tmp_path: Path) -> None:
    """A dead tip force F L^2/EI = 1 (a chain of rigid links, extrapolated); about the reference the
    force does nothing.
    """
    load = "{type: point_force, at: beam.right, force: [0, -1]}"
    done = fmbs(
        "run", beam(tmp_path, "{type: modes, count: 3}", load), "--json", "--out", tmp_path / "out"
    )
    assert done.code == 0, done.err
    exact = np.array([3.77092591, 21.7517582, 60.5149876]) / (2 * np.pi)
    assert done.json["frequencies_hz"] == pytest.approx(exact, rel=1e-5)
    assert done.json["about"] == "equilibrium"
    with pytest.warns(Notice, match="in which these do nothing: tip"):
        found = studies.run(beam(tmp_path, "{type: modes, count: 1, about: reference}", load))
    assert found.frequencies == pytest.approx(3.51601527 / (2 * np.pi), rel=1e-5)


def test_a_follower_force_flutters_and_says_so(tmp_path: Path) -> None:
    """Beck: stable at 19.5 EI/L^2, flutter at 20.05."""
    still = studies.run(
        beam(
            tmp_path,
            "{type: modes, count: 2}",
            "{type: follower, at: beam.right, force: [-19.5, 0]}",
        )
    )
    assert still.frequencies == pytest.approx(
        np.array([9.4497809312, 12.6728704024]) / (2 * np.pi), rel=5e-5
    )
    path = beam(
        tmp_path, "{type: modes, count: 2}", "{type: follower, at: beam.right, force: [-20.5, 0]}"
    )
    with pytest.warns(Notice, match=r"the equilibrium is unstable \(flutter\)"):
        found = studies.run(path, out=tmp_path / "out")
    assert max(found.report["growth_per_s"]) > 0.1
    head = (tmp_path / "out" / "modes.csv").read_text().splitlines()[0]
    assert head == "mode,frequency_hz,omega_rad_per_s,damping_ratio,growth_per_s,share_beam"


def test_a_column_beyond_its_buckling_load_is_unstable(tmp_path: Path) -> None:
    load = "{type: point_force, at: beam.right, force: [-3, 0]}"
    with pytest.warns(Notice, match=r"the equilibrium is unstable \(divergence\): mode 1"):
        studies.run(beam(tmp_path, "{type: modes, count: 2}", load))
    found = studies.run(beam(tmp_path, "{type: buckling, count: 2}", load), out=tmp_path / "out")
    assert found.report["load_factors"] == pytest.approx(
        np.pi**2 / 12 * np.array([1.0, 9.0]), rel=1e-5
    )
    assert np.loadtxt(tmp_path / "out" / "factors.csv", delimiter=",", skiprows=1)[
        :, 1
    ] == pytest.approx(found.report["load_factors"])


TWO_RODS = """
schema: 1
dimension: 2
bodies:
  lower: {type: rigid, mass: 1, inertia: 0.1, center: [0, 0.5], points: {foot: [0, 0], top: [0, 1]}}
  upper: {type: rigid, mass: 1, inertia: 0.1, center: [0, 1.5], points: {foot: [0, 1], top: [0, 2]}}
joints: {ground: {type: revolute, at: lower.foot}, knee: {type: revolute, at: upper.foot, to: lower.top}}
loads:
  first: {type: torsion_spring, at: lower.frame, stiffness: 30}
  second: {type: torsion_spring, at: upper.frame, to: lower.frame, stiffness: 20}
  side: {type: spring_damper, at: lower.top, to: [2, 1], stiffness: 5}
  push: {type: point_force, at: PLACE, force: [0, -1]}
analysis: {type: buckling, count: 2}
"""


@pytest.mark.parametrize(
    ("place", "factors"),
    [
        (
            "upper.top",
            np.linalg.eigvalsh([[55.0, -20.0], [-20.0, 20.0]]),
        ),  # both rods bear the load: K - P 1
        (
            "lower.top",
            [55.0 - 20.0**2 / 20.0],
        ),  # one does: there is no second factor, and round-off is none
    ],
)
def test_two_rods_on_springs_buckle_at_as_many_loads_as_they_bear(
    place: str, factors: Sequence[float]
) -> None:
    found = studies.run(scenes.loads(TWO_RODS.replace("PLACE", place)))
    assert found.report["load_factors"] == pytest.approx(factors, rel=1e-7)


def test_a_blade_in_a_turning_frame(tmp_path: Path) -> None:
    """Wright et al. (1982) at Omega = 6 sqrt(EI/(rhoA L^4)): flapping at 7.3604, lagging at
    sqrt(7.3604^2 - 36).
    """
    found = studies.run(beam(tmp_path, "{type: modes, count: 2, spin: {rate: 6}}", dim=3))
    assert 2 * np.pi * found.frequencies == pytest.approx(
        [np.sqrt(7.3604**2 - 36.0), 7.3604], rel=1e-4
    )
    assert found.report["damping_ratios"] == pytest.approx([0.0, 0.0], abs=1e-6)


@pytest.mark.parametrize(
    ("analysis", "load", "joint", "message"),
    [
        (
            "{type: modes}",
            "{type: point_force, at: beam.right, force: [1, 1]}",
            "pin",
            "take the modes about the reference",
        ),
        ("{type: buckling}", "", "clamp", "loads that change the stiffness"),
        ("{type: modes, spin: {rate: 5 m}}", "", "clamp", "an angular velocity"),
        ("{type: modes, damped: 1}", "", "clamp", "analysis.damped"),
    ],
)
def test_what_has_no_modes_is_refused(
    analysis: str, load: str, joint: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=message):
        studies.run(beam(tmp_path, analysis, load, joint))


@pytest.mark.parametrize("method", ["load_steps", "arc_length"])
def test_sweeps_of_equilibria(tmp_path: Path, method: str) -> None:
    """Each member is the equilibrium that `run` finds; little bent, w = P L^3 / (3 EI)."""
    text = beam(
        tmp_path,
        f"{{type: static, load_steps: 4, method: {method}}}",
        "{type: point_force, at: beam.right, force: [0, P]}",
    )
    outputs = "outputs: {tip: {type: position, at: beam.right, component: y}}\nparameters: {P: {value: 0.01 N, range: [0.01 N, 2 N]}}\n"
    text.write_text(text.read_text() + outputs)
    with ThreadPoolExecutor(1) as threads:
        found = studies.sweep(text, samples=3, design="grid", scheduler=threads)
    np.testing.assert_allclose(found.points[:, 0], [0.01, 1.005, 2.0])
    last = [column[np.isfinite(column)][-1] for column in found.outputs["tip"]]
    assert last[0] == pytest.approx(0.01 / 3.0, rel=2e-5)
    assert last[2] == pytest.approx(
        studies.run(text, parameters={"P": 2.0}).outputs["tip"][-1], rel=1e-12
    )


MASSES = """\
schema: 1
dimension: 2
bodies:
  a: {type: point_mass, mass: 1 kg, position: [0, 0]}
BODIES
analysis: {type: modes, damped: DAMPED}
"""


@pytest.mark.parametrize("damped", ["true", "false"])
def test_small_systems_have_as_many_modes_as_motions(damped: str) -> None:
    """One free mass, and two on a spring, without a count: sqrt(k (1/m1 + 1/m2)) beside the free
    motions.
    """
    two = "  b: {type: point_mass, mass: 3 kg, position: [1, 0]}\nloads: {s: {type: spring_damper, at: a, to: b, stiffness: 75}}"
    text = MASSES.replace("DAMPED", damped)
    assert studies.run(scenes.loads(text.replace("BODIES\n", ""))).frequencies == pytest.approx(
        [0.0, 0.0]
    )
    found = studies.run(scenes.loads(text.replace("BODIES", two))).frequencies
    assert found == pytest.approx([0.0, 0.0, 0.0, 10.0 / (2 * np.pi)])


def test_what_is_held_everywhere_has_no_modes() -> None:
    """It says so."""
    rigid = "joints: {c: {type: clamp, at: b.frame}}"
    body = "  b: {type: rigid, mass: 1, inertia: 1, center: [0, 0]}"
    text = MASSES.replace("DAMPED", "false").replace(
        "  a: {type: point_mass, mass: 1 kg, position: [0, 0]}\nBODIES", f"{body}\n{rigid}"
    )
    with pytest.raises(
        InputError, match="expected motions that the joints leave, got none; release a joint"
    ):
        studies.run(scenes.loads(text))
