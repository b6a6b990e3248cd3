"""Example 2 of Hou, Liu, Hu (2020), doi 10.1016/j.cma.2019.112690: two flexible beams fall under their weight.

The full model, and one of a basis and a few weighted elements a beam, trained on it.
"""

from __future__ import annotations

from pathlib import Path

from fmbs_skfem import bodies, dynamics, reduction, systems
from fmbs_skfem.systems import At, System
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes

MESH = Path(__file__).resolve().parents[1] / "meshes" / "double_pendulum_100.msh"


def pendulum() -> System:
    """Two beams at right angles with spherical joints at A and B, all constraints as multipliers."""
    section, material = (
        bodies.Circular(diameter=0.01),
        bodies.Material(young_modulus=1e9, density=1800.0),
    )
    beams = [bodies.cable(name, MESH, section, material, group=name) for name in ("I", "II")]
    return systems.assemble(
        beams,
        [joints.Pin("A", At("I", "A")), joints.Pin("B", At("I", "B"), At("II", "B"))],
        [loads.Gravity((0.0, 0.0, -9.81))],
        outputs={"C": probes.Position(At("II", "C"))},
    )


def main(
    duration: float = 3.0, step: float = 5e-4, eps: float = 1e-12, eta: float = 1e-3
) -> dict[str, float]:
    """Sizes of both models, the last position of C [m], and errors and CPU seconds."""
    raw, scheme = pendulum(), dynamics.GeneralizedAlpha(step, rho_inf=0.8)
    full = dynamics.integrate(
        systems.eliminate(raw), scheme, duration, dynamics.Newton(tolerance=1e-12)
    )
    plan = reduction.Plan(reduction.body_level(raw), eps, hyper=reduction.Elements(eta))
    task = reduction.task_of(reduction.Case(raw, scheme, duration), plan, interval=10 * step)
    small = reduction.train(task, motion=full).model.system
    motion = dynamics.integrate(small, scheme, duration)
    errors = reduction.compare(full, motion)
    final = {name: float(values[-1]) for name, values in dynamics.outputs(full).items()}
    cost = {"full_cpu_s": full.statistics.cpu_s, "reduced_cpu_s": motion.statistics.cpu_s}
    return {"dofs": raw.size, "modes": small.size, "max_error": errors.maximum, **final, **cost}


if __name__ == "__main__":
    print(main())
