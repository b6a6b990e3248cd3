"""Frequencies over a parameter: an overhung rotor against its closed form, motions that cross, the example."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.dynamics.campbell import Found

ROTOR = Path(__file__).parents[2] / "examples" / "rotor.yaml"


def whirl(speed: float) -> np.ndarray:
    """|w - speed| of a disk on a massless shaft, det(K - w^2 diag(m, Id) + w speed diag(0, Ip)) = 0 (Genta 2005, section 2.3)."""
    EI, L, m, Ip, Id = 4e3, 1.0, 8.0, 0.4, 0.2
    K, M, G = EI / L**3 * np.array([[12.0, -6.0 * L], [-6.0 * L, 4.0 * L**2]]), np.diag([m, Id]), np.diag([0.0, Ip * speed])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [np.linalg.solve(M, K), np.linalg.solve(M, G)]])
    return np.sort(np.abs(np.linalg.eigvals(A).real - speed))


def test_an_overhung_rotor_whirls_as_it_should() -> None:
    text = ROTOR.read_text().replace("rhoA: 0.15 kg/m", "rhoA: 1e-5 kg/m").replace("steps: 33", "steps: 5")
    text = text.replace("../meshes", "meshes").replace("damping: {mass: 0.6 1/s, stiffness: 0.2 ms}", "")
    scene = scenes.loads(text, ROTOR.parents[1])
    found = scene.analysis.find(scene).diagram
    assert found is not None
    for value, omega in zip(found.values, found.omega, strict=True):
        np.testing.assert_allclose(np.sort(omega), whirl(value), rtol=2e-4)
    assert (np.diff(found.omega[:, found.omega[1, :2].argmax()]) > 0.0).all()  # the backward whirl goes its way


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
    """Damping inside of the shaft: unstable above w (1 + c_outside / c_inside), c_inside = beta w^2 m (see `test_near_states`)."""
    w = whirl(0.0)[0]
    growth = np.array(run.report["growth_per_s"])
    values = run.report["values"]
    first = values[(growth > 0.0).any(axis=0).argmax()]
    assert first - 25.0 <= w * (1.0 + 0.6 / (2e-4 * w**2)) * 1.02 <= first * 1.02
    assert [path.name for path in run.files] == ["campbell.csv", "report.json", "campbell.png"]
    critical = run.report["crossings"][0]["speed"]
    assert critical == pytest.approx(w / 2.0, rel=0.05)  # of the weight; gyroscopic terms raise it a little


def test_motions_that_cross_are_told_apart() -> None:
    """Two oscillators whose frequencies 1 + s and 2 - s cross at 1/2, in vectors that turn little by little."""

    def find(s: float, count: int) -> Found:
        angle = 0.1 * s
        V = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        omega = np.array([1.0 + s, 2.0 - s])
        order = np.argsort(omega)
        return Found(omega[order], np.zeros(2), V[:, order], np.eye(2))

    found = dynamics.campbell(np.linspace(0.0, 1.0, 10), find, 2)
    np.testing.assert_allclose(found.omega[:, 0], 1.0 + found.values)
    np.testing.assert_allclose(found.omega[:, 1], 2.0 - found.values)
    assert found.crossings(2.0)[0] == (1, pytest.approx(2.0 / 3.0))


def test_a_parameter_without_a_range_is_named() -> None:
    text = ROTOR.read_text().replace("{value: 100 rad/s, range: [0 rad/s, 400 rad/s]}", "100 rad/s")
    scene = scenes.loads(text, ROTOR.parent)
    with pytest.raises(InputError, match=r"a parameter with a range.*'speed'; write speed: \{value"):
        scene.analysis.find(scene)
