"""What a step makes wrong is said by a run in half the steps: held to the exact motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import studies
from fmbs_skfem.core.errors import InputError

SPRING = """
schema: 1
dimension: 2
bodies: {{ball: {{type: point_mass, mass: 1 kg, position: [1 m, 0]}}}}
loads: {{pull: {{type: spring_damper, at: ball, to: [0, 0], stiffness: 1 N/m, damping: 0, length: 0}}}}
initial: {{bodies: {{ball: {{velocity: [0, 1 m/s]}}}}}}
analysis: {{{analysis}}}
outputs: {{ball: {{type: position, at: ball}}}}
"""


def written(folder: Path, analysis: str) -> Path:
    path = folder / "spring.yaml"
    path.write_text(SPRING.format(analysis=analysis))
    return path


@pytest.mark.parametrize("every", ["every: 4", "every: [{until: 6 s, every: 0.2 s}]"])
def test_the_error_of_a_step_is_that_of_the_exact_motion(tmp_path: Path, every: str) -> None:
    """A ball on a spring without length goes round: x = cos t, y = sin t."""
    run = studies.run(
        written(tmp_path, f"type: dynamic, duration: 6 s, step: 50 ms, {every}"), check=True
    )
    found = run.report["step_check"]
    t = run.trajectory.times
    for column, exact in (("ball_x", np.cos(t)), ("ball_y", np.sin(t))):
        true = np.abs(run.outputs[column] - exact).max()
        assert found["errors"][column] == pytest.approx(true, rel=0.02)
    assert found["step"] == 0.025
    assert found["part"] == pytest.approx(
        found["errors"][found["largest"]] / np.ptp(run.outputs[found["largest"]]), rel=0.02
    )
    assert any("the step makes" in str(line) for line in run.lines)


def test_what_has_no_step_of_its_own_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--check: expected a scene with a dynamic analysis"):
        studies.run(written(tmp_path, "type: static, load_steps: 2"), check=True)
    path = written(tmp_path, "type: dynamic, duration: 1 s, accuracy: 1e-2")
    with pytest.raises(InputError, match="an accuracy proves its errors itself"):
        studies.run(path, check=True)


def test_the_end_that_an_event_makes_counts(tmp_path: Path) -> None:
    """A ball at 10 m/s stops where its swing of 5 Hz is at the bottom: the step moves that place."""
    path = tmp_path / "ball.yaml"
    path.write_text("""
schema: 1
dimension: 2
bodies: {ball: {type: point_mass, mass: 1 kg, position: [0, 0.1]}}
loads: {pull: {type: control_force, at: ball, direction: [0, 1], force: "-(10*pi)**2 * ball.y * 1 N/m"}}
initial: {bodies: {ball: {velocity: [10 m/s, 0]}}}
events: {low: {when: ball.y + 0.09 m, stop: true}}
analysis: {type: dynamic, duration: 1 s, step: 2 ms}
outputs: {ball: {type: position, at: ball}}
""")
    run = studies.run(path, check=True)
    true = abs(10.0 * np.arccos(-0.9) / (10.0 * np.pi) - run.outputs["ball_x"][-1])
    assert true > 1e-5
    assert run.report["step_check"]["errors"]["ball_x"] == pytest.approx(true, rel=0.1)
