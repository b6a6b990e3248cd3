"""A planar linkage with stress: cables without and with it, beams with shear in the plane, and in
space.

    python benchmarks/linkage.py [repetitions]

One scene of a driven four-bar, at one step and one number of cells; CPU seconds of the run with its
outputs, the least of the repetitions, which alternate. Stresses are held against those of the finest
beams in the plane.
"""

from __future__ import annotations

import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import dynamics, scenes
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import eliminate

RESULTS = Path(__file__).resolve().parent / "results"
CELLS, STEPS, DURATION = 20, 1000, 1.0
SCENE = """\
schema: 1
dimension: 2
bodies:
  crank: {{type: {kind}, line: {{start: [0, 0], end: [0, 0.2]}}, cells: {cells}, {more}}}
  coupler: {{type: {kind}, line: {{start: [0, 0.2], end: [0.5, 0.4]}}, cells: {cells}, {more}}}
  rocker: {{type: {kind}, line: {{start: [0.5, 0], end: [0.5, 0.4]}}, cells: {cells}, {more}}}
joints:
  O: {{type: {hinge}, at: crank.left{axis}}}
  A: {{type: {hinge}, at: crank.right, to: coupler.left{axis}}}
  B: {{type: {last}, at: coupler.right, to: rocker.right}}
  C: {{type: {hinge}, at: rocker.left{axis}}}
  motor: {{type: driven_angle, at: crank.left{axis}, angle: {{profile: minimum_jerk, to: 720 deg, duration: 1 s}}}}
damping: {{stiffness: 50 us}}
analysis: {{type: dynamic, duration: {duration} s, step: {step} s}}
outputs:
  tip: {{type: position, at: rocker.right}}
{stress}"""
SECTION = "section: {shape: rectangular, width: 20 mm, height: 8 mm}, material: aluminium_6061"
STRESS = "".join(
    f"  {body}_stress: {{type: highest_stress, of: {body}}}\n" for body in ("crank", "coupler")
)


class Row(NamedTuple):
    """One kind of bodies: least CPU seconds, over those of cables without stress, and how far the
    largest von Mises stress of the coupler is from that of the finest beams; None without it.
    """

    name: str
    cpu_s: float
    ratio: float
    error: float | None


def text(kind: str, stress: bool, cells: int, step: float, space: bool = False) -> str:
    """The scene of one kind of bodies."""
    words = SCENE.format(
        kind=kind,
        cells=cells,
        more=SECTION + ", direction: [0, 0, -1]" * space,
        hinge="revolute" if space else "pin",
        last="spherical" if space else "pin",
        axis=", axis: [0, 0, 1]" * space,
        duration=DURATION,
        step=step,
        stress=STRESS * stress,
    )
    if not space:
        return words
    words = words.replace("dimension: 2", "dimension: 3")
    for x, y in ((0, 0), (0, 0.2), (0.5, 0.4), (0.5, 0)):
        words = words.replace(f"[{x}, {y}]", f"[{x}, {y}, 0]")
    return words


def timed(words: str, folder: Path) -> tuple[float, dict[str, np.ndarray]]:
    """CPU seconds of the motion and its outputs, and these."""
    scene = scenes.loads(words, folder)
    system = eliminate(build.system(scene))
    begin = time.process_time()
    motion = dynamics.integrate(system, build.dynamic(scene).scheme, DURATION)
    found = dynamics.outputs(motion)
    return time.process_time() - begin, found


def main(repetitions: int = 5) -> list[Row]:
    """Measure all kinds, and write linkage.md into benchmarks/results."""
    step = DURATION / STEPS
    kinds = {
        "cables, without stress": text("cable", False, CELLS, step),
        "cables": text("cable", True, CELLS, step),
        "beams in the plane": text("beam", True, CELLS, step),
        "beams in space": text("beam", True, CELLS, step, True),
    }
    least = dict.fromkeys(kinds, np.inf)
    found = {}
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        _, fine = timed(text("beam", True, 2 * CELLS, step / 4.0), Path(folder))
        for _ in range(1 + repetitions):
            for name, words in kinds.items():
                spent, found[name] = timed(words, Path(folder))
                least[name] = min(least[name], spent)
    column = "coupler_stress_von_mises"
    rows = []
    for name, spent in least.items():
        error = None
        if column in found[name]:
            error = float(found[name][column].max() / fine[column].max() - 1.0)
        rows.append(Row(name, spent, spent / least["cables, without stress"], error))
    lines = [
        "# A planar linkage with stress",
        "",
        f"A driven four-bar, {CELLS} cells a member, {STEPS} steps; errors are of the largest von Mises stress of the coupler.",
        "",
        "| bodies | CPU [s] | over cables without stress | error of the stress |",
        "|---|---|---|---|",
        *(
            f"| {row.name} | {row.cpu_s:.3f} | {row.ratio:.2f} | {'' if row.error is None else f'{row.error:+.2%}'} |"
            for row in rows
        ),
    ]
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "linkage.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines[4:]))
    return rows


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
