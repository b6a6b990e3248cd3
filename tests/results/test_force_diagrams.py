"""Diagrams of section forces against statics of frames: values at the extremes, sides, directions of
the frame, files of `fmbs render --diagram`.
"""

from __future__ import annotations

import csv
import itertools
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.results import force_diagrams
from fmbs_skfem.scenes import build
from fmbs_skfem.systems.measures.section_diagrams import LineForces, along_lines

P, Q, L = 3.0, 2.0, 2.0  #: [N, N/m, m]
EI = 1e6  #: [N m2]

CANTILEVER = """
schema: 1
dimension: {dim}
bodies:
  beam:
    type: {kind}
    line: {{start: {start}, end: {end}}}
    cells: 40
    section: {{shape: rectangular, width: 30 mm, height: 30 mm}}
    material: steel
joints: {{clamp: {{type: clamp, at: beam.left}}}}
loads:
  P: {{type: point_force, at: beam.right, force: {force}}}
  q: {{type: line_load, body: beam, force: {load}}}
analysis: {{type: static, load_steps: 1}}
"""


def forces_of(text: str) -> dict[str, LineForces]:
    scene = scenes.loads(text)
    end = studies.run(scene).trajectory
    return along_lines(end.system, build.parts(scene), end.x[-1])


def cantilever(kind: str, along: np.ndarray, down: np.ndarray) -> LineForces:
    """A cantilever in some direction, away from the origin, under a force and a load a length."""
    start = np.arange(1.0, 1.0 + len(along))
    values = {
        "start": start.tolist(),
        "end": (start + L * along).tolist(),
        "force": (P * down).tolist(),
        "load": (Q * down).tolist(),
    }
    return forces_of(CANTILEVER.format(dim=len(along), kind=kind, **values))["beam"]


@pytest.mark.parametrize("angle", [0.0, 2.0])
def test_a_cantilever_in_the_plane(angle: float) -> None:
    """Q = dM/ds = P + q (L - s), M = -P (L - s) - q (L - s)^2 / 2, drawn on the upper side, which it
    stretches.
    """
    along = np.array([np.cos(angle), np.sin(angle)])
    down = np.array([np.sin(angle), -np.cos(angle)])
    found = cantilever("cable", along, down)
    left = L - found.arcs
    M = -(P * left + Q * left**2 / 2)
    assert_allclose(found.diagrams["Q"].values, P + Q * left, rtol=1e-4)
    assert_allclose(found.diagrams["M"].values, M, atol=2e-4 * abs(M[0]))
    assert np.abs(found.diagrams["N"].values).max() < 2e-3 * P
    drawn = found.diagrams["M"].values[:, None] * found.diagrams["M"].directions
    assert_allclose(drawn[:, :2] @ -down, np.abs(M), atol=2e-4 * abs(M[0]))
    assert_allclose(found.points[-1, :2], [1.0, 2.0] + L * along)


@pytest.mark.parametrize("kind", ["cable", "beam"])
@pytest.mark.parametrize("down", [(0.0, 0.0, -1.0), (-0.6, 0.0, -0.8)])
def test_a_cantilever_in_space(kind: str, down: tuple[float, float, float]) -> None:
    """The same about two axes of the section: sizes, and the side of the moment."""
    aim = np.array(down)
    along = np.array([0.8, 0.0, -0.6]) if down[0] else np.array([0.0, 1.0, 0.0])
    found = cantilever(kind, along, aim)
    left = L - found.arcs
    M = P * left + Q * left**2 / 2
    across = ("Q",) if kind == "cable" else ("Vy", "Vz")
    about = ("M",) if kind == "cable" else ("My", "Mz")
    shear, moment = (
        sum(one.values[:, None] * one.directions for one in map(found.diagrams.get, names) if one)
        for names in (across, about)
    )
    assert_allclose(shear, (P + Q * left)[:, None] * aim, atol=1e-3 * (P + Q * L))
    assert_allclose(moment, M[:, None] * -aim, atol=1e-3 * M[0])


def test_a_portal_of_two_bays() -> None:
    """Moments by slope deflection, M_ij = 2 k (2 t_i + t_j - 3 psi) + M_0, k = EI / l; shear and
    axial forces from equilibrium of each member and joint. S. P. Timoshenko, D. H. Young, Theory of
    Structures, McGraw-Hill 1965.
    """
    h, l, q, H = 3.0, 4.0, 10.0, 10.0
    (kc, kb) = (EI / h, EI / l)
    # rotations of the three upper joints, anticlockwise, and the rotation psi of the columns
    K = np.array(
        [
            [4 * kc + 4 * kb, 2 * kb, 0.0, -6 * kc],
            [2 * kb, 4 * kc + 8 * kb, 2 * kb, -6 * kc],
            [0.0, 2 * kb, 4 * kc + 4 * kb, -6 * kc],
            [6 * kc, 6 * kc, 6 * kc, -36 * kc],
        ]
    )
    fixed = q * l**2 / 12  # of a beam at its left end, anticlockwise on it
    *t, psi = np.linalg.solve(K, [-fixed, 0.0, fixed, H * h])
    foot = np.array([2 * kc * (one - 3 * psi) for one in t])
    head = np.array([2 * kc * (2 * one - 3 * psi) for one in t])
    beams = [
        (2 * kb * (2 * a + b) + fixed, 2 * kb * (2 * b + a) - fixed)
        for a, b in itertools.pairwise(t)
    ]
    found = forces_of(portal())
    size = max(abs(end) for pair in beams for end in pair)
    columns = [found[name].diagrams for name in ("left", "mid", "right")]
    # M of a diagram is that of the end beyond, anticlockwise: -M_ij at the start, M_ij at the end
    assert_allclose([one["M"].values[0] for one in columns], -foot, atol=1e-3 * size)
    assert_allclose([one["M"].values[-1] for one in columns], head, atol=1e-3 * size)
    assert_allclose([one["Q"].values[0] for one in columns], (foot + head) / h, atol=1e-3 * size)
    shears = [q * l / 2 + (a + b) / l for a, b in beams]
    for name, (a, b), start in zip(("beam", "beam2"), beams, shears, strict=True):
        own = found[name].diagrams
        assert_allclose(own["M"].values[[0, -1]], [-a, b], atol=1e-3 * size)
        assert_allclose(own["Q"].values[[0, -1]], [start, start - q * l], rtol=1e-3)
        assert own["M"].values.max() == pytest.approx(start**2 / (2 * q) - a, abs=1e-3 * size)
    ends = [start - q * l for start in shears]
    carried = [-shears[0], ends[0] - shears[1], ends[1]]
    assert_allclose([one["N"].values[5] for one in columns], carried, rtol=1e-3)


def portal() -> str:
    section = f"section: {{shape: given, EA: 1e11, EI: {EI}, rhoA: 10}}"
    lines = {
        "left": ([0, 0], [0, 3]),
        "beam": ([0, 3], [4, 3]),
        "mid": ([4, 0], [4, 3]),
        "beam2": ([4, 3], [8, 3]),
        "right": ([8, 0], [8, 3]),
    }
    bodies = "\n".join(
        f"  {name}: {{type: cable, line: {{start: {a}, end: {b}}}, cells: {count}, {section}}}"
        for name, (a, b) in lines.items()
        for count in [40 if a[1] else 8]
    )
    return f"""
schema: 1
dimension: 2
bodies:
{bodies}
joints:
  a: {{type: clamp, at: left.left}}
  b: {{type: clamp, at: mid.left}}
  c: {{type: clamp, at: right.left}}
  d: {{type: weld, at: left.right, to: beam.left}}
  e: {{type: weld, at: beam.right, to: mid.right}}
  f: {{type: weld, at: beam2.left, to: mid.right}}
  g: {{type: weld, at: beam2.right, to: right.right}}
loads:
  q: {{type: line_load, body: beam, force: [0, -10 N/m]}}
  q2: {{type: line_load, body: beam2, force: [0, -10 N/m]}}
  H: {{type: point_force, at: left.right, force: [10 N, 0]}}
analysis: {{type: static, load_steps: 1}}
"""


def test_files_of_a_diagram(tmp_path: Path) -> None:
    """A table whose numbers are those of the outputs, a picture, and the report of the folder."""
    text = CANTILEVER.format(
        dim=2, kind="cable", start=[0, 0], end=[L, 0], force=[0, -P], load=[0, -Q]
    )
    read = "outputs: {n: {type: section_forces, at: {body: beam, s: 0.5 m}}}\nanalysis"
    (tmp_path / "beam.yaml").write_text(text.replace("analysis", read))
    out = tmp_path / "out"
    done = studies.render(tmp_path / "beam.yaml", gif=False, diagram=True, out=out)
    assert {"diagram.png", "diagram.csv"} < {path.name for path in done.files}
    with (out / "diagram.csv").open() as file:
        heads, *rows = csv.reader(file)
    assert heads == ["body", "s [m]", "N [N]", "Q [N]", "M [N m]"]
    at = next(row for row in rows if float(row[1]) == 0.5)
    assert_allclose(
        [float(at[2]), float(at[4])],
        [done.outputs["n_N"][-1], done.outputs["n_M"][-1]],
        rtol=1e-8,
    )
    page = studies.report(out, bodies=False).files[0].read_text()
    assert 'alt="diagram.png"' in page
    assert "diagram.csv" in page
    with pytest.raises(InputError, match="--at: expected the option --diagram beside it"):
        studies.render(tmp_path / "beam.yaml", at=1.0)


def test_a_figure_has_a_panel_a_force_with_its_extremes() -> None:
    found = force_diagrams.figure(
        {"beam": cantilever("cable", np.array([1.0, 0.0]), np.array([0.0, -1.0]))}
    )
    panels = {axes.get_title(): {text.get_text() for text in axes.texts} for axes in found.axes}
    assert panels["Q [N]"] == {"7", "3"}
    assert panels["M [N m]"] == {"-10"}
    with pytest.raises(InputError, match="a scene with a cable or a beam"):
        force_diagrams.figure({})
