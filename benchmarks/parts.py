"""Reduced parts against full models of the same scenes: example 2 from one beam trained alone, and long chains of it.

    python benchmarks/parts.py [--cells 100] [--duration 3] [--arms 10 30] [--chain 0.5]

Errors are the largest distance of the free end [m]; times are ratios by the least CPU time of alternating runs.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import reduction
from fmbs_skfem.bodies import Body, Circular, Material, cable
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.reduction import excitation, part_files, parts
from fmbs_skfem.systems import At, System, assemble, eliminate, joints, loads, probes
from fmbs_skfem.verification.beams import straight

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
DOWN, ASKEW = (0.0, 0.0, -9.81), (0.0, -9.81 / np.sqrt(2.0), 9.81 / np.sqrt(2.0))
SHARP, USUAL = Newton(tolerance=1e-12), Newton(tolerance=2e-11)
SCHEME = GeneralizedAlpha(5e-4)


def beam(cells: int) -> Body:
    """A beam of example 2."""
    return cable("arm", straight(cells), Circular(0.01), Material(1e9, 1800.0))


def double_pendulum(body: Body, weight: tuple[float, ...] = DOWN, other: bool = False, all_multipliers: bool = False) -> System:
    """Example 2, hung at A, or at C; one output, the free end."""
    bodies = [parts.placed(body, "I"), parts.placed(body, "II", np.array([1.0, 0.0, 0.0]), QUARTER)]
    hung, free = (At("II", "right"), At("I", "left")) if other else (At("I", "left"), At("II", "right"))
    held = [joints.Pin("A", hung), joints.Pin("B", At("I", "right"), At("II", "left"))]
    found = assemble(bodies, held, [loads.Gravity(weight)], outputs={"free": probes.Position(free)})
    return found if all_multipliers else eliminate(found)


def chain(body: Body, arms: int) -> System:
    """Arms one behind the other along x, hung at the first; one output, the free end."""
    bodies = [parts.placed(body, f"arm{k}", np.array([float(k), 0.0, 0.0])) for k in range(arms)]
    held = [joints.Pin("root", At("arm0", "left"))]
    held += [joints.Pin(f"joint{k}", At(f"arm{k - 1}", "right"), At(f"arm{k}", "left")) for k in range(1, arms)]
    free = {"free": probes.Position(At(f"arm{arms - 1}", "right"))}
    return eliminate(assemble(bodies, held, [loads.Gravity(DOWN)], outputs=free))


def free_end(motion: Trajectory) -> np.ndarray:
    """(s, 3) [m]."""
    found = outputs(motion)
    return np.stack([found[f"free_{axis}"] for axis in "xyz"], axis=1)


def distance(one: Trajectory, other: Trajectory) -> float:
    """Largest distance of the free ends [m]."""
    return float(np.linalg.norm(free_end(one) - free_end(other), axis=1).max())


def least(runs: dict[str, Callable[[], Trajectory]], rounds: int) -> dict[str, float]:
    """Least CPU seconds of alternating runs."""
    spent = dict.fromkeys(runs, np.inf)
    for _ in range(rounds):
        for name, run in runs.items():
            spent[name] = min(spent[name], run().statistics.cpu_s)
    return spent


def example_2(cells: int, duration: float, rounds: int = 3) -> dict[str, float]:
    """Errors in the three mechanisms, the time over those of the full and of today's reduced model, and the training [CPU s]."""
    full = beam(cells)
    begun = time.process_time()
    states = excitation.excite(full, excitation.Excitation())
    part = part_files.train(full, states)
    spent = time.process_time() - begun
    cases = {"training_like": (DOWN, False), "askew": (ASKEW, False), "hung_at_the_other_end": (DOWN, True)}
    found = {"training_s": spent, "functions": float(part.notes["functions"]), "points": float(part.notes["points"])}
    for name, case in cases.items():
        wanted, reduced = (
            integrate(double_pendulum(body, *case), SCHEME, duration, newton, 10)
            for body, newton in ((full, SHARP), (part.body, USUAL))
        )
        found[f"error_{name}"] = distance(wanted, reduced)
    raw = double_pendulum(full, all_multipliers=True)
    sharp = integrate(eliminate(raw), SCHEME, duration, SHARP, 10)
    plan = reduction.Plan(reduction.body_level(raw), 1e-12, hyper=reduction.Points(1e-3))
    task = reduction.task_of(reduction.Case(raw, SCHEME, duration), plan, interval=10 * SCHEME.step)
    modes = reduction.train(task, motion=sharp).model.system
    found["error_modes_of_coordinates"] = distance(sharp, integrate(modes, SCHEME, duration, USUAL, 10))
    systems = {"full": double_pendulum(full), "modes": modes, "part": double_pendulum(part.body)}
    spent_by = least({name: _run(system, duration) for name, system in systems.items()}, rounds)
    found["time_over_full"] = spent_by["part"] / spent_by["full"]
    found["time_over_modes_of_coordinates"] = spent_by["part"] / spent_by["modes"]
    return found


def _run(system: System, duration: float) -> Callable[[], Trajectory]:
    return lambda: integrate(system, SCHEME, duration, USUAL, 10)


def chains(cells: int, duration: float, arms: int, rounds: int = 2) -> dict[str, float]:
    """Error over the length of a chain of one part that was trained alone, the speed-up, and the assembly [CPU s]."""
    full = beam(cells)
    part = part_files.train(full, excitation.excite(full, excitation.Excitation()))
    begun = time.process_time()
    reduced = chain(part.body, arms)
    spent = time.process_time() - begun
    systems = {"full": chain(full, arms), "part": reduced}
    one, other = (integrate(system, SCHEME, duration, USUAL, 10) for system in systems.values())
    spent_by = least({name: _run(system, duration) for name, system in systems.items()}, rounds)
    return {
        "arms": float(arms),
        "unknowns_full": float(systems["full"].size),
        "unknowns": float(reduced.size),
        "error_over_length": distance(one, other) / arms,
        "full_over_part": spent_by["full"] / spent_by["part"],
        "assembly_s": spent,
    }


def main() -> None:
    """Print all figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=100)
    parser.add_argument("--duration", type=float, default=3.0)
    parser.add_argument("--arms", type=int, nargs="*", default=[10, 30])
    parser.add_argument("--chain", type=float, default=0.5, help="duration of chains [s]")
    options = parser.parse_args()
    with threadpool_limits(limits=1, user_api="blas"):
        for name, value in example_2(options.cells, options.duration).items():
            print(f"example 2, {name}: {value:.3g}", flush=True)
        for arms in options.arms:
            for name, value in chains(options.cells, options.chain, arms).items():
                print(f"chain, {name}: {value:.4g}", flush=True)


if __name__ == "__main__":
    main()
