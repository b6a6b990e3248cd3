"""Frequencies over a parameter: an overhung rotor against its closed form, motions that cross, the
example.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics.near_state.campbell import MotionsAt
from fmbs_skfem.studies.result import ReportTable

ROTOR = Path(__file__).parents[2] / "examples" / "rotor.yaml"


def whirl(speed: float) -> np.ndarray:
    """|w - speed| of a disk on a massless shaft, det(K - w^2 diag(m, Id) + w speed diag(0, Ip)) = 0
    (Genta 2005, section 2.3).
    """
    EI, L, m, Ip, Id = 4e3, 1.0, 8.0, 0.4, 0.2
    K, M, G = (
        EI / L**3 * np.array([[12.0, -6.0 * L], [-6.0 * L, 4.0 * L**2]]),
        np.diag([m, Id]),
        np.diag([0.0, Ip * speed]),
    )
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [np.linalg.solve(M, K), np.linalg.solve(M, G)]])
    return np.sort(np.abs(np.linalg.eigvals(A).real - speed))


def test_an_overhung_rotor_whirls_as_it_should() -> None:
    text = (
        ROTOR.read_text()
        .replace("rhoA: 0.15 kg/m", "rhoA: 1e-5 kg/m")
        .replace("steps: 33", "steps: 5")
    )
    text = text.replace("../meshes", "meshes").replace(
        "damping: {mass: 0.6 1/s, stiffness: 0.2 ms}", ""
    )
    scene = scenes.loads(text, ROTOR.parents[1])
    found = scene.analysis.find(scene).diagram
    assert found is not None
    for value, omega in zip(found.values, found.omega, strict=True):
        np.testing.assert_allclose(np.sort(omega), whirl(value), rtol=2e-4)
    assert (
        np.diff(found.omega[:, found.omega[1, :2].argmax()]) > 0.0
    ).all()  # the backward whirl goes its way


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> studies.Run:
    folder = tmp_path_factory.mktemp("rotor")
    (folder / "scenes").mkdir()
    (folder / "beam_5.msh").write_bytes((ROTOR.parents[1] / "meshes" / "beam_5.msh").read_bytes())
    path = folder / "scenes" / "rotor.yaml"
    path.write_text(ROTOR.read_text().replace("steps: 33", "steps: 17").replace("../meshes", ".."))
    with pytest.warns(Notice, match="is unstable from speed = 125 on"):
        return studies.run(path, out=folder / "out")


def test_the_example_is_unstable_above_its_threshold(run: studies.Run) -> None:
    """Damping inside of the shaft: unstable above w (1 + c_outside / c_inside), c_inside = beta w^2
    m (see `test_near_states`).
    """
    w = whirl(0.0)[0]
    growth = np.array(run.report["growth_per_s"])
    values = run.report["values"]
    first = values[(growth > 0.0).any(axis=0).argmax()]
    assert first - 25.0 <= w * (1.0 + 0.6 / (2e-4 * w**2)) * 1.02 <= first * 1.02
    assert [path.name for path in run.files] == ["campbell.csv", "report.json", "campbell.png"]
    first = run.report["crossings"][0]
    critical = first["speed"]
    assert first["frequency_hz"] == pytest.approx(critical / (2.0 * np.pi), rel=1e-12)
    (_, table) = (line for line in run.lines if isinstance(line, ReportTable))
    assert table.title == "Crossings of orders"
    assert list(table.rows[0]) == ["1", first["mode"], critical, first["frequency_hz"]]
    assert critical == pytest.approx(
        w / 2.0, rel=0.05
    )  # of the weight; gyroscopic terms raise it a little


def test_motions_that_cross_are_told_apart() -> None:
    """Two oscillators whose frequencies 1 + s and 2 - s cross at 1/2, in vectors that turn little
    by little.
    """

    def find(s: float, count: int) -> MotionsAt:
        angle = 0.1 * s
        V = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        omega = np.array([1.0 + s, 2.0 - s])
        order = np.argsort(omega)
        return MotionsAt(omega[order], np.zeros(2), V[:, order], np.eye(2))

    found = dynamics.campbell(np.linspace(0.0, 1.0, 10), find, 2)
    np.testing.assert_allclose(found.omega[:, 0], 1.0 + found.values)
    np.testing.assert_allclose(found.omega[:, 1], 2.0 - found.values)
    assert found.crossings(2.0)[0] == (1, pytest.approx(2.0 / 3.0))


def test_motions_whose_frequencies_bend_are_followed_by_their_shapes() -> None:
    """Between two values one frequency rises from 10 to 14 and the other one falls from 12 to 10.5:
    neither as before.
    """
    frequencies = {0.0: [10.0, 12.0], 1.0: [10.0, 12.0], 2.0: [14.0, 10.5]}

    def find(s: float, count: int) -> MotionsAt:
        omega = np.array(frequencies[s])
        order = np.argsort(omega)
        return MotionsAt(omega[order], np.zeros(2), np.eye(2)[:, order], np.eye(2))

    found = dynamics.campbell(np.array([0.0, 1.0, 2.0]), find, 2)
    np.testing.assert_array_equal(found.omega, list(frequencies.values()))


COLUMN = """\
schema: 1
dimension: 2
parameters: {P: {value: 1 N, range: [0 N, 20 N]}}
bodies: {c: {type: cable, mesh: beam_10.msh, section: {shape: given, EA: 1 MN, EI: 1 N m^2, rhoA: 1 kg/m}}}
joints: {a: {type: pin, at: c.left}, b: {type: slider, at: c.right, direction: [1, 0]}}
loads: {P: {type: point_force, at: c.right, force: [-P, 0]}}
damping: {mass: RATE}
analysis: {type: campbell, parameter: P, count: 2, steps: 11, damped: true}
"""


@pytest.mark.parametrize("rate", [0.5, 3.0, 20.0])
def test_a_column_that_buckles_goes_on_as_the_motion_that_grows(rate: float) -> None:
    """s^2 + rate s + w^2 (1 - P / Pc) = 0, Pc = pi^2 EI / L^2, w^2 = Pc^2 / EI rho A: the root of
    larger growth at all loads.
    """
    scene = scenes.loads(COLUMN.replace("RATE", f"{rate}"), ROTOR.parents[1] / "meshes")
    table = scene.analysis.find(scene)
    found = table.diagram
    assert found is not None
    assert "mode 1 is unstable from P = 10 on" in table.doubts
    assert not found.others.any()
    exact = -rate / 2 + np.emath.sqrt(rate**2 / 4 - np.pi**4 * (1.0 - found.values / np.pi**2))
    overdamped = exact.imag == 0.0
    np.testing.assert_allclose(
        found.growth[overdamped, 0], exact.real[overdamped], rtol=2e-3, atol=2e-3
    )
    np.testing.assert_allclose(found.omega[:, 0], exact.imag, rtol=2e-3)


def test_growth_beside_the_motions_that_are_listed_is_told() -> None:
    """One motion is asked for; another grows where s > 1/2."""

    def find(s: float, count: int) -> MotionsAt:
        return MotionsAt(
            np.array([1.0, 2.0]), np.array([0.0, max(s - 0.5, 0.0)]), np.eye(2), np.eye(2)
        )

    found = dynamics.campbell(np.linspace(0.0, 1.0, 11), find, 1)
    np.testing.assert_allclose(found.others, np.maximum(found.values - 0.5, 0.0), atol=1e-15)


def test_a_parameter_without_a_range_is_named() -> None:
    text = ROTOR.read_text().replace("{value: 100 rad/s, range: [0 rad/s, 400 rad/s]}", "100 rad/s")
    scene = scenes.loads(text, ROTOR.parent)
    with pytest.raises(
        InputError, match=r"a parameter with a range.*'speed'; write speed: \{value"
    ):
        scene.analysis.find(scene)
