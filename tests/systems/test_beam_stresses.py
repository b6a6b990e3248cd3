"""Strains and stresses of beams with torsion at a place, against closed forms; in full, in reduced
models and in scenes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import studies
from fmbs_skfem.bodies.beams.beam import beam
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.sections import BeamSection, Circular, Material, Rectangular
from fmbs_skfem.bodies.tapered import Tapered
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.dynamics import outputs, solve_statics
from fmbs_skfem.shapes import curves
from fmbs_skfem.systems import At, assemble, eliminate, joints, loads
from fmbs_skfem.systems.measures.line_stresses import Stress
from fmbs_skfem.systems.measures.probes import Probe, column_units
from fmbs_skfem.systems.measures.stresses import SectionStrains, StrainGauge

STEEL, NU = Material(210e9, 7850.0, 0.3), 0.3
E, G = 210e9, 210e9 / 2.6
PLACE = At("beam", 0.3)
MESHES = Path(__file__).parents[2] / "meshes"


def cantilever(section: BeamSection, cells: int = 16) -> Body:
    """A metre along x, y of the section along y of the scene."""
    line = curves.Line(
        np.linspace(0.0, 1.0, cells + 1),
        curves.Straight(np.zeros(3), np.eye(3)[0], 1.0),
        {"a": 0.0, "b": 1.0},
        None,
    )
    return beam("beam", line, section, direction=np.array([0.0, 1.0, 0.0]))


def loaded(
    section: BeamSection,
    force: tuple[float, ...],
    torque: float,
    sensed: dict[str, Probe],
    cells: int = 16,
) -> dict[str, float]:
    """Outputs under a small force and a torque at the end."""
    push = [
        loads.PointForce("F", At("beam", "b"), force),
        loads.Moment("T", At("beam", "b"), (torque, 0.0, 0.0)),
    ]
    system = assemble(
        [cantilever(section, cells)], [joints.Clamp("root", At("beam", "a"))], push, outputs=sensed
    )
    return {
        name: float(values[-1])
        for name, values in outputs(solve_statics(eliminate(system), 1)).items()
    }


def test_a_round_bar_under_bending_and_torsion() -> None:
    """Stresses M c / I and T r / J, von Mises' sqrt(s^2 + 3 t^2), strains and three gauges on top
    of it.
    """
    d, F, T = 0.02, 1.0, 0.4
    sensed: dict[str, Probe] = {
        f"g{a}": StrainGauge(PLACE, (0.0, d / 2), np.radians(a)) for a in (0, 45, 90)
    }
    sensed |= {"e": SectionStrains(PLACE), "s": Stress(PLACE), "top": Stress(PLACE, (0.0, d / 2))}
    found = loaded(Circular(d).of_beam(STEEL), (0.0, 0.0, -F), T, sensed)
    M, I, J = 0.7 * F, np.pi * d**4 / 64, np.pi * d**4 / 32
    s, t = M * d / 2 / I, T * d / 2 / J
    assert_allclose(
        [found[f"top_{word}"] for word in ("normal", "von_mises")],
        [s, np.hypot(s, np.sqrt(3) * t)],
        rtol=2e-3,
    )
    # the polygon that stands for the circle has its chord, V across it adds nothing on top
    assert found["top_shear"] == pytest.approx(t, rel=2e-3)
    assert_allclose([found["s_max"], found["s_min"]], [s, -s], rtol=2e-4)
    assert_allclose(
        [found["e_torsion"], found["e_curvature_y"]], [T / (G * J), M / (E * I)], rtol=2e-4
    )
    assert_allclose([found["e_axial"], found["e_curvature_z"]], 0.0, atol=1e-4 * M / (E * I))
    gauges = [s / E, 0.5 * (1.0 - NU) * s / E + 0.5 * t / G, -NU * s / E]
    assert_allclose([found[f"g{a}"] for a in (0, 45, 90)], gauges, rtol=2e-3)


def test_strains_of_a_line_and_shear_at_the_neutral_axis() -> None:
    """N / EA, V / kGA with Cowper's k of a rectangle; Timoshenko and Goodier: 3/2 V/A in the middle
    of a narrow one's side.
    """
    b, h, N, V = 2e-3, 0.02, 0.03, 1e-3
    section = Rectangular(b, h).of_beam(STEEL)
    found = loaded(
        section, (N, 0.0, V), 0.0, {"e": SectionStrains(PLACE), "side": Stress(PLACE, (b / 2, 0.0))}
    )
    k = (10 + 10 * NU) / (12 + 11 * NU)
    assert found["e_axial"] == pytest.approx(N / (E * b * h), rel=1e-4)
    assert found["e_shear_z"] == pytest.approx(V / (k * G * b * h), rel=1e-3)
    assert found["side_shear"] == pytest.approx(1.5 * V / (b * h), rel=1e-2)
    assert found["side_normal"] == pytest.approx(N / (b * h), rel=1e-4)


def test_bending_stresses_converge_with_the_cells() -> None:
    """Of a bar whose moment is linear, at 25 places: 3.2e-3, 2.6e-4 and 1e-7 are missed with 10, 20
    and 40 cells.
    """
    section, places = Rectangular(0.01, 0.02).of_beam(STEEL), np.linspace(0.2, 0.8, 25)
    sensed: dict[str, Probe] = {
        f"s{k}": Stress(At("beam", float(place))) for k, place in enumerate(places)
    }
    exact = (1.0 - places) * 0.01 / (0.01 * 0.02**3 / 12)
    errors = []
    for cells in (10, 20, 40):
        found = loaded(section, (0.0, 0.0, -1e-2), 0.0, sensed, cells)
        errors.append(
            max(abs(found[f"s{k}_max"] / (1e-2 * one) - 1.0) for k, one in enumerate(exact))
        )
    assert errors[0] < 4e-3
    assert errors[1] < errors[0] / 8
    assert errors[2] < 1e-6


def test_units_are_named() -> None:
    part = cantilever(Circular(0.02).of_beam(STEEL))
    named = assemble(
        [part],
        outputs={
            "e": SectionStrains(PLACE),
            "s": Stress(PLACE),
            "g": StrainGauge(PLACE, (0.0, 0.01)),
        },
    )
    units = column_units(named.outputs)
    assert (units["e_torsion"], units["e_axial"], units["s_max"], units["g"]) == (
        "1/m",
        "",
        "Pa",
        "",
    )


@pytest.mark.parametrize(
    ("section", "output", "message"),
    [
        (BeamSection(np.eye(6), np.eye(3)), Stress(PLACE), "a beam whose contour is known"),
        (
            BeamSection(np.eye(6), np.eye(3)),
            StrainGauge(PLACE, (0.0, 0.01)),
            "a beam whose contour is known",
        ),
        (
            Circular(0.02).of_beam(STEEL),
            Stress(PLACE, (0.0, 0.02)),
            r"a point of the contour, got \(0, 0.02\) m; the nearest one is",
        ),
    ],
)
def test_what_has_no_stress_is_refused(section: BeamSection, output: Probe, message: str) -> None:
    with pytest.raises(InputError, match=message):
        assemble([cantilever(section)], outputs={"s": output})


SCENE = """\
schema: 1
bodies:
  beam: {{type: beam, mesh: {mesh}, cells: 8, direction: [0, 1, 0], section: {{shape: rectangular, width: 30 mm, height: 10 mm}},
         material: {{young_modulus: 5 GPa, density: 1800 kg/m^3}}}}
joints: {{root: {{type: clamp, at: beam.left}}}}
loads:
  F: {{type: point_force, at: beam.right, force: [0, 2 N, -8 N], history: "1 - cos(12*t)"}}
  T: {{type: moment, at: beam.right, moment: [1 N m, 0, 0], history: "1 - cos(9*t)"}}
analysis: {{type: dynamic, duration: 0.4 s, step: 2 ms}}
outputs:
  n: {{type: section_forces, at: {{body: beam, s: 0.2 m}}}}
  e: {{type: section_strains, at: {{body: beam, s: 0.2 m}}}}
  s: {{type: stress, at: {{body: beam, s: 0.2 m}}}}
  g: {{type: strain_gauge, at: {{body: beam, s: 0.2 m}}, point: [0, 5 mm], direction: 45 deg}}
reduction: {{snapshots: 2 ms, tolerance: 1e-13, hyper_reduction: {{sample: none}}}}
"""


def test_reduced_models_read_them_too(tmp_path: Path) -> None:
    """By the same rows: stresses of a saved model in 30 or so of 144 coordinates are those of the
    full one to 2 %.
    """
    path = tmp_path / "b.yaml"
    path.write_text(SCENE.format(mesh=MESHES / "beam_20.msh"))
    full = studies.run(path, allow_outside=True).table()
    studies.reduce(path, out=tmp_path / "b.h5", allow_outside=True)
    small = studies.run(tmp_path / "b.h5").table()
    for column in ("s_von_mises [Pa]", "s_max [Pa]", "g", "e_torsion [1/m]", "n_My [N m]"):
        assert np.abs(small[column] - full[column]).max() < 0.02 * np.ptp(full[column]), column


def test_a_beam_that_tapers_has_the_stress_of_its_section_at_the_place() -> None:
    """A round bar from 40 to 20 mm: 32 M / (pi d^3) and 16 T / (pi d^3) with the diameter there."""
    bar = Tapered({0.0: Circular(0.04), 1.0: Circular(0.02)})
    line = curves.Line(
        np.linspace(0.0, 1.0, 25),
        curves.Straight(np.zeros(3), np.eye(3)[0], 1.0),
        {"a": 0.0, "b": 1.0},
        None,
    )
    part = beam("beam", line, bar, STEEL, direction=np.array([0.0, 1.0, 0.0]))
    push = [
        loads.PointForce("F", At("beam", "b"), (0.0, 0.0, -1.0)),
        loads.Moment("T", At("beam", "b"), (0.6, 0.0, 0.0)),
    ]
    places = (0.1, 0.45, 0.8)
    sensed: dict[str, Probe] = {f"s{x}": Stress(At("beam", x)) for x in places}
    found = outputs(
        solve_statics(
            eliminate(
                assemble([part], [joints.Clamp("root", At("beam", "a"))], push, outputs=sensed)
            ),
            1,
        )
    )
    for x in places:
        d = 0.04 - 0.02 * x
        sigma, tau = 32.0 * (1.0 - x) / (np.pi * d**3), 16.0 * 0.6 / (np.pi * d**3)
        assert found[f"s{x}_max"][-1] == pytest.approx(sigma, rel=5e-3)
        # the shear force adds to the torque's on one side
        assert found[f"s{x}_von_mises"][-1] == pytest.approx(
            np.hypot(sigma, np.sqrt(3.0) * tau), rel=2e-2
        )
