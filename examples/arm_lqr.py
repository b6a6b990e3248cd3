"""A flexible arm under optimal control: linearised from its torque to its motion, and steered step by step.

The arm turns at 0.5 rad/s when the controller takes over; u = - K z with the linear-quadratic gain K of the lowest modes z brings
it to rest where it was. What the linear system promises, z(t) = exp((A - B K) t) z(0), stands beside what the arm does.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.linalg import expm, solve_continuous_are

from fmbs_skfem import bodies, dynamics, systems
from fmbs_skfem.core.inputs import Input
from fmbs_skfem.core.responses import of_state
from fmbs_skfem.systems import At, Motion, Rayleigh, joints, probes
from fmbs_skfem.systems.controls import ControlTorque

MESHES = Path(__file__).resolve().parents[1] / "meshes"


def main(mesh: str = "beam_20.msh", modes: int = 8, duration: float = 2.0, step: float = 1e-3) -> dict[str, float]:
    """Largest and last angle of the hinge [rad], the largest one that was promised, and the largest difference of the two."""
    arm = bodies.cable("arm", MESHES / mesh, bodies.Circular(0.02), bodies.Material(3e9, 1800.0), dim=2)
    root, tip = At("arm", "left"), At("arm", "right")
    raw = systems.assemble(
        [arm],
        [joints.Pin("hinge", root)],
        [ControlTorque("motor", root, torque=of_state("u", "N m"))],
        damping=Rayleigh(stiffness=1e-3),
        outputs={"hinge": probes.Angle(root), "tip": probes.Position(tip)},
        initial={"arm": Motion(angular_velocity=0.5)},
        inputs=[Input("u", "N m")],
    )
    system = systems.eliminate(raw)
    near = dynamics.state_space(system, dynamics.linearise(system), outputs=["hinge"], count=modes)
    Q, R = np.eye(2 * modes) + 10.0 * near.C.T @ near.C, np.array([[0.1]])
    K = np.linalg.solve(R, near.B.T @ solve_continuous_are(near.A, near.B, Q, R))

    run, hinge, promised = dynamics.start(system, dynamics.GeneralizedAlpha(step)), [0.0], [0.0]
    z = near.states(run.motion())[0]
    one = expm((near.A - near.B @ K) * step)
    while run.time < duration - 0.5 * step:
        run.step({"u": float((-K @ near.states(run.motion())[0]).item())})
        z = one @ z
        hinge.append(run.outputs()["hinge"])
        promised.append(float((near.C @ z).item()))
    return {
        "largest": float(np.abs(hinge).max()),
        "promised": float(np.abs(promised).max()),
        "difference": float(np.abs(np.subtract(hinge, promised)).max()),
        "final": abs(hinge[-1]),
    }


if __name__ == "__main__":
    print(main())
