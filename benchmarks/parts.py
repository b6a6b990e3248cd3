"""Reduced parts against full models of the same scenes, each by its name; without names all of
them.

    python benchmarks/parts.py [--scale 0.25]
        [example_2 invariant other_end chain four_bar corner machine pushed example_3 example_3_fine assembly]

Errors are the largest distance of an output from that of the full model, over the length that is
named; times are ratios by the least CPU time of alternating runs. `--scale` shortens all motions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from fmbs_skfem import reduction, scenes
from fmbs_skfem.bodies import Body, Circular, Material, cable
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.parts import bodies as parts
from fmbs_skfem.parts import departures, excitation
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.parts.excitation import Excitation
from fmbs_skfem.parts.files import Part
from fmbs_skfem.reduction import cases, snapshots
from fmbs_skfem.reduction.accuracy import runs
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes.meshes import segment
from fmbs_skfem.systems import At, Motion, System, assemble, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import probes
from verification.plates import rectangle

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
DOWN, ASKEW = (0.0, 0.0, -9.81), (0.0, -9.81 / np.sqrt(2.0), 9.81 / np.sqrt(2.0))
SHARP, USUAL = Newton(tolerance=1e-12), Newton(tolerance=2e-11)
SCHEME = GeneralizedAlpha(5e-4)
Figures = dict[str, float]


def beam(cells: int = 100, length: float = 1.0, name: str = "arm") -> Body:
    """A beam of example 2, or of another length."""
    return cable(
        name, segment(cells, end=(length, 0.0, 0.0)), Circular(0.01), Material(1e9, 1800.0)
    )


def link(n1: int = 10, n2: int = 2, length: float = 1.0, width: float = 0.1) -> Body:
    """A link of 10 mm of a soft plastic, its corners `a` to `d`."""
    return plate(
        "link", rectangle("bfs", n1, n2, length, width), 1e-2, Material(2e9, 1200.0, 0.3), dim=3
    )


def alone(
    body: Body,
    share: float = 1.0,
    eps: float = part_files.USUAL,
    eta: float = part_files.ETA,
    **excited: float,
) -> tuple[Part, float]:
    """The part of a body that is trained alone by forces of a share of its weight, and the CPU time
    of it.
    """
    begun = time.process_time()
    force = share * 9.81 * float(body.constant @ (body.mass @ body.constant))
    states = excitation.excite(body, Excitation(force=force, **excited))  # type: ignore[arg-type]
    return part_files.train(body, states, eps, None, eta), time.process_time() - begun


def coarser(
    kinds: Sequence[Part],
    make: Callable[..., System],
    eps: Sequence[float] = (),
    modes: Sequence[tuple[int, ...]] = (),
    eta: float | None = None,
    name: str = "part",
) -> dict[str, System]:
    """Systems of parts as they are, and with the leading shape functions that each eps, or so many
    of every kind, ask for.

    Their points are chosen to eta.
    """
    cuts = {f"{name} at {e:g}": [(e, None)] * len(kinds) for e in eps}
    cuts |= {
        f"{name} of {', '.join(map(str, counts))}": [(None, count) for count in counts]
        for counts in modes
    }
    found = {name: make(*(one.body for one in kinds))}
    for label, cut in cuts.items():
        found[label] = make(
            *(part_files.coarsen(one, *how, eta).body for one, how in zip(kinds, cut, strict=True))
        )
    return found


def hung(body: Body, weight: tuple[float, ...] = DOWN, other: bool = False) -> System:
    """Example 2 with all multipliers, hung at A, or at C; one output, the free end."""
    bodies = [parts.placed(body, "I"), parts.placed(body, "II", np.array([1.0, 0.0, 0.0]), QUARTER)]
    held, free = (
        (At("II", "right"), At("I", "left")) if other else (At("I", "left"), At("II", "right"))
    )
    pins = [joints.Pin("A", held), joints.Pin("B", At("I", "right"), At("II", "left"))]
    return assemble(bodies, pins, [loads.Gravity(weight)], outputs={"free": probes.Position(free)})


def chain_of(body: Body, arms: int) -> System:
    """Arms one behind the other along x, hung at the first; one output, the free end."""
    bodies = [parts.placed(body, f"arm{k}", np.array([float(k), 0.0, 0.0])) for k in range(arms)]
    held = [joints.Pin("root", At("arm0", "left"))]
    held += [
        joints.Pin(f"joint{k}", At(f"arm{k - 1}", "right"), At(f"arm{k}", "left"))
        for k in range(1, arms)
    ]
    free = {"free": probes.Position(At(f"arm{arms - 1}", "right"))}
    return assemble(bodies, held, [loads.Gravity(DOWN)], outputs=free)


def distance(one: Trajectory, other: Trajectory) -> float:
    """Largest distance of any output [m], positions by their components."""
    first, second = outputs(one), outputs(other)
    apart = {name: first[name] - second[name] for name in first if "_" in name}
    groups = {name.rsplit("_", 1)[0] for name in apart}
    return max(
        float(np.linalg.norm([apart[k] for k in apart if k.startswith(f"{g}_")], axis=0).max())
        for g in groups
    )


def least(runs: dict[str, Callable[[], Trajectory]], rounds: int) -> Figures:
    """Least CPU seconds of alternating runs."""
    spent = dict.fromkeys(runs, np.inf)
    for _ in range(rounds):
        for name, run in runs.items():
            spent[name] = min(spent[name], run().statistics.cpu_s)
    return spent


def runner(
    system: System, scheme: GeneralizedAlpha, duration: float, newton: Newton = USUAL
) -> Callable[[], Trajectory]:
    """A run of a system; of its form without linear constraints."""
    form = system if system.full is not None or system.components else eliminate(system)
    return lambda: integrate(form, scheme, duration, newton, 10)


def against(
    full: System,
    models: dict[str, System],
    duration: float,
    size: float,
    scheme: GeneralizedAlpha = SCHEME,
    rounds: int = 2,
) -> Figures:
    """Errors of models over a length, and the time of the full model over theirs."""
    wanted, found = runner(full, scheme, duration, SHARP)(), dict[str, float]()
    for name, system in models.items():
        motion = runner(system, scheme, duration)()
        found[f"error {name}"] = distance(wanted, motion) / size
        found[f"{name} beyond the training"] = float(len(departures.find(motion)))
        found[f"unknowns {name}"] = float(runner(system, scheme, scheme.step)().system.size)
    spent = least(
        {name: runner(one, scheme, duration) for name, one in {"full": full, **models}.items()},
        rounds,
    )
    return found | {f"full over {name}": spent["full"] / spent[name] for name in models}


def of_coordinates(
    raw: System, states: Trajectory, duration: float, invariant: bool = False, eta: float = 1e-3
) -> System:
    """Modes of a system from its own motion at eps = 1e-12, and sampled points."""
    plan = reduction.Plan(
        reduction.body_level(raw),
        1e-12,
        hyper=reduction.Points(eta),
        invariant=invariant,
        eliminate=invariant,
    )
    task = reduction.task_of(reduction.Case(raw, SCHEME, duration), plan, interval=10 * SCHEME.step)
    return reduction.train(task, motion=states).model.system


def example_2(scale: float, cells: int = 100, rounds: int = 3) -> Figures:
    """One beam trained alone in the three mechanisms, beside modes of coordinates trained on the
    first of them.
    """
    full, duration = beam(cells), 3.0 * scale
    part, spent = alone(full)
    hinged = alone(full, eps=1e-13, moment=0.0)[0]
    found = {
        "training [CPU s]": spent,
        "functions": float(part.notes["functions"]),
        "points": float(part.notes["points"]),
    }

    def of_parts(make: Callable[..., System]) -> dict[str, System]:
        found = coarser([part], make, (3e-11, 1e-9))
        few = coarser([hinged], make, modes=((9,), (10,)), eta=1e-3, name="part without moments")
        return found | {name: one for name, one in few.items() if name not in found}

    for name, case in {"askew": (ASKEW, False), "hung at the other end": (DOWN, True)}.items():
        wanted = runner(hung(full, *case), SCHEME, duration, SHARP)()
        for label, system in of_parts(lambda body, case=case: hung(body, *case)).items():
            found[f"error {label}, {name} [m]"] = distance(
                wanted, runner(system, SCHEME, duration)()
            )
    raw = hung(full)
    modes = of_coordinates(raw, runner(raw, SCHEME, duration, SHARP)(), duration)
    models = of_parts(hung) | {"modes of coordinates": modes}
    return found | against(raw, models, duration, 1.0, rounds=rounds)


def invariant(scale: float) -> Figures:
    """Bases of example 2 from its own motion: modes of coordinates and of vectors, with sampled
    points.
    """
    raw, duration = hung(beam()), 3.0 * scale
    motion = runner(raw, SCHEME, duration, SHARP)()
    models = {"coordinates": of_coordinates(raw, motion, duration)}
    models |= {
        f"vectors, eta {eta:g}": of_coordinates(raw, motion, duration, True, eta)
        for eta in (1e-3, 3e-4, 1e-4)
    }
    return against(raw, models, duration, 1.0, rounds=3)


def other_end(scale: float) -> Figures:
    """A part trained on the motion of example 2, hung at the other end."""
    full, duration = beam(), 3.0 * scale
    states = snapshots(runner(hung(full), SCHEME, duration, SHARP)()).q.reshape(
        -1, len(full.reference), 3
    )
    part = part_files.train(full, states)
    return against(hung(full, DOWN, True), {"part": hung(part.body, DOWN, True)}, duration, 1.0)


def chain(scale: float, arms: int = 10, cells: int = 100) -> Figures:
    """A chain of arms released from the horizontal over 2 s, one part trained alone, or on the
    motion of two arms.
    """
    full, duration = beam(cells), 2.0 * scale
    part, spent = alone(full)
    motion = runner(chain_of(full, 2), SCHEME, 3.0 * scale, SHARP)()
    pair = part_files.train(full, snapshots(motion).q.reshape(-1, len(full.reference), 3))
    models = coarser([part], lambda body: chain_of(body, arms), (1e-8, 1e-6))
    models |= coarser(
        [pair], lambda body: chain_of(body, arms), modes=((6,),), eta=3e-2, name="part of two arms"
    )
    return {"training [CPU s]": spent} | against(
        chain_of(full, arms), models, duration, float(arms), rounds=1
    )


def links(crank: Body, coupler: Body, rocker: Body) -> System:
    """A closed spatial four-bar: crank and rocker turn about skew edges, the coupler hangs between
    their free corners.
    """
    lean = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    turn = np.array([[0.0, 0.3, 1.0], [0.0, 1.0, -0.3], [-1.0, 0.0, 0.0]])
    turn[:, 1:] /= np.sqrt(1.09)
    turn = turn @ np.diag([1.0, np.linalg.det(turn), 1.0])
    first = parts.placed(crank, "crank", np.zeros(3), lean)
    low = place_of(first, "b")
    middle = parts.placed(coupler, "coupler", low, np.eye(3))
    end = place_of(middle, "b")
    last = parts.placed(rocker, "rocker", end - turn @ np.array([1.0, 0.0, 0.0]), turn)
    pins = [
        joints.Pin(f"{body} {name}", At(body, name))
        for body in ("crank", "rocker")
        for name in "ad"
    ]
    pins += [
        joints.Pin("low", At("crank", "b"), At("coupler", "a")),
        joints.Pin("high", At("coupler", "b"), At("rocker", "b")),
    ]
    push = loads.PointForce("push", At("crank", "b"), (1.0, 0.0, 0.0))
    seen = {"low": probes.Position(At("crank", "b")), "high": probes.Position(At("rocker", "b"))}
    return assemble([first, middle, last], pins, [loads.Gravity(DOWN), push], outputs=seen)


def place_of(body: Body, name: str) -> np.ndarray:
    """Reference position of a place (c,)."""
    from fmbs_skfem.bodies.body import locate, probe

    return np.asarray(probe(body, locate(body, name)) @ body.reference)[0]


def four_bar(scale: float) -> Figures:
    """A closed spatial four-bar of plate links, one part trained alone, used three times."""
    full = link()
    part, spent = alone(full, 0.3, 1e-13, 1e-3, step=1e-3, samples=300, duration=1.5)
    models = coarser([part], lambda body: links(body, body, body), modes=((15,), (10,)), eta=3e-2)
    found = against(links(full, full, full), models, 1.0 * scale, 1.0, rounds=1)
    return {"training [CPU s]": spent, "functions": float(part.notes["functions"])} | found


def corner(scale: float) -> Figures:
    """A thin plate hung at a corner and thrown round, more than a turn; modes of coordinates of
    this motion beside the part.
    """
    full = plate("sheet", rectangle("bfs", 6, 6, 0.5, 0.5), 3e-3, Material(2e9, 1200.0, 0.3), dim=3)
    part, spent = alone(full, 0.3, 1e-8, 1e-3, step=5e-4, samples=300, duration=1.0)

    def thrown(body: Body) -> System:
        start = {"sheet": Motion(angular_velocity=(0.0, 9.0, 2.0))}
        pin = joints.Pin("corner", At("sheet", "a"))
        return assemble(
            [body],
            [pin],
            [loads.Gravity(DOWN)],
            outputs={"c": probes.Position(At("sheet", "c"))},
            initial=start,
        )

    raw, duration = thrown(full), 0.9 * scale
    models = coarser([part], thrown, (5e-8,), ((23,), (24,), (25,)), 6e-2)
    models["modes of coordinates"] = of_coordinates(
        raw, runner(raw, SCHEME, duration, SHARP)(), duration
    )
    found = against(raw, models, duration, 0.5 * np.sqrt(2.0), rounds=1)
    return {"training [CPU s]": spent, "functions": float(part.notes["functions"])} | found


def machine_of(post: Body, rail: Body, flag: Body, bays: int, force: float = 2.0) -> System:
    """Posts hang in a row, rails join their feet, flags hang from the rails by a corner; the first
    rail is pushed [N].
    """
    down = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    bodies, pins = [], []
    for k in range(bays + 1):
        bodies.append(parts.placed(post, f"post{k}", np.array([float(k), 0.0, 0.0]), down))
        pins.append(joints.Pin(f"top{k}", At(f"post{k}", "left")))
    for k in range(bays):
        foot = np.array([float(k), 0.0, -0.5])
        bodies += [
            parts.placed(rail, f"rail{k}", foot),
            parts.placed(flag, f"flag{k}", foot + np.array([0.5, 0.0, 0.0]), down),
        ]
        pins += [
            joints.Pin(f"left{k}", At(f"rail{k}", "left"), At(f"post{k}", "right")),
            joints.Pin(f"right{k}", At(f"rail{k}", "right"), At(f"post{k + 1}", "right")),
            joints.Pin(f"flag{k}", At(f"flag{k}", "a"), At(f"rail{k}", "middle")),
        ]
    push = loads.PointForce("push", At("rail0", "left"), (force, 0.25 * force, 0.0))
    seen = {
        "first": probes.Position(At("flag0", "c")),
        "last": probes.Position(At(f"flag{bays - 1}", "c")),
    }
    return assemble(bodies, pins, [loads.Gravity(DOWN), push], outputs=seen)


def kinds() -> tuple[Body, Body, Body]:
    """Post, rail and flag."""
    rail = segment(20)
    rail.point_groups["middle"] = np.array([10])
    return (
        beam(20, 0.5, "post"),
        cable("rail", rail, Circular(0.012), Material(1e9, 1800.0)),
        plate("flag", rectangle("bfs", 4, 2, 0.3, 0.1), 2e-3, Material(2e9, 1200.0, 0.3), dim=3),
    )


def machine(scale: float, bays: int = 33) -> Figures:
    """A machine of 3 bays + 1 parts of three kinds, each trained alone by what it carries here;
    errors over a bay.
    """
    full = kinds()
    carried = (6.0, 1e-3), (2.0, 1e-3), (0.5, 5e-4)  #: loads over the weight, steps [s]
    trained = [
        alone(one, share, 1e-10, 1e-3, step=h, samples=300, duration=1.0)
        for one, (share, h) in zip(full, carried, strict=True)
    ]
    cuts = (5, 10, 6), (4, 6, 6), (3, 7, 5)
    models = coarser(
        [part for part, _ in trained], lambda *own: machine_of(*own, bays), modes=cuts, eta=1e-2
    )
    found = against(machine_of(*full, bays), models, 0.5 * scale, 1.0, rounds=3)
    return {
        "parts": 3.0 * bays + 1.0,
        "training [CPU s]": sum(spent for _, spent in trained),
    } | found


def pushed(scale: float, bays: int = 2) -> Figures:
    """The same pushed by 20 N, of parts that were trained by their weights, and by what they meet
    here.
    """
    full, models = kinds(), dict[str, System]()
    for name, shares in {"weights": (0.5, 0.5, 0.5), "pushes": (15.0, 5.0, 1.0)}.items():
        trained = zip(full, shares, strict=True)
        own = [
            alone(one, share, 1e-10, 1e-3, step=5e-4, samples=300, duration=1.0)[0].body
            for one, share in trained
        ]
        models[f"part trained by {name}"] = machine_of(*own, bays, 20.0)
    return against(machine_of(*full, bays, 20.0), models, 0.25 * scale, 1.0, rounds=1)


def example_3(scale: float, name: str = "crank_slider_coarse") -> Figures:
    """Crank and linkage trained alone; x_C over 0.3 m, beside modes of coordinates with the exact
    polynomial.
    """
    scene = scenes.read(EXAMPLES / f"{name}.yaml")
    bodies, h, duration = build.parts(scene), 1e-5, round(20_000 * scale) * 1e-5
    begun = time.process_time()
    told = Excitation(
        runs=2,
        force=3000.0,
        moment=15.0,
        duration=0.015,
        step=h,
        slowest=20.0,
        fastest=800.0,
        samples=300,
        rise=0.0,
    )
    trained = {one.name: excitation.excite(one, told) for one in bodies if one.cells is not None}
    small = [
        part_files.train(one, trained[one.name], 1e-14, None, 3e-3).body
        if one.name in trained
        else one
        for one in bodies
    ]
    found = {"training [CPU s]": time.process_time() - begun}
    raw = build.of_parts(scene, bodies)
    models = {"part": eliminate(build.of_parts(scene, small))}
    scheme = GeneralizedAlpha(h, 0.8)
    plan = reduction.Plan(
        {"crank": ("crank",), "linkage": ("linkage", "slider")}, 1e-16, hyper=reduction.Exact()
    )
    case = cases.Case(raw, scheme, duration, Newton(tolerance=4e-10))
    task = reduction.task_of(
        case, plan, interval=10 * h, form=lambda system: build.chosen_form(scene, system)
    )
    kept = runs.kept_steps(case, 10 * h)
    sharp = cases.Case(build.chosen_form(scene, raw), scheme, duration, SHARP)
    motion = cases.run(sharp, kept)
    found["full [CPU s]"] = motion.statistics.cpu_s
    models["modes of coordinates, exact"] = (
        reduction.train(task, motion=motion).model.cases({}).system
    )
    tolerance = Newton(tolerance=1e-12)
    solved = {
        name: cases.run(cases.Case(one, scheme, duration, tolerance), kept)
        for name, one in models.items()
    }
    for name, one in solved.items():
        found[f"error {name}"] = (
            float(np.abs(outputs(one)["x_C"] - outputs(motion)["x_C"]).max()) / 0.3
        )
        found[f"unknowns {name}"] = float(one.system.size)
        found[f"{name} [CPU s]"] = one.statistics.cpu_s
    return found


def example_3_fine(scale: float) -> Figures:
    """The same on the fine meshes."""
    return example_3(scale, "crank_slider")


def assembly(scale: float, count: int = 200) -> Figures:
    """Assembling many parts, and leaving out the constraints of their joints [CPU s]."""
    part = part_files.train(
        beam(), excitation.excite(beam(), Excitation(runs=2, duration=0.2 * scale, step=1e-3))
    ).body
    begun = time.process_time()
    system = chain_of(part, count)
    middle = time.process_time()
    eliminate(system)
    return {
        "parts": float(count),
        "assembled [CPU s]": middle - begun,
        "eliminated [CPU s]": time.process_time() - middle,
    }


ALL: tuple[Callable[[float], Figures], ...] = (
    example_2,
    invariant,
    other_end,
    chain,
    four_bar,
    corner,
    machine,
    pushed,
    example_3,
    example_3_fine,
    assembly,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the figures of all that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=[one.__name__ for one in ALL])
    parser.add_argument("--scale", type=float, default=1.0)
    options = parser.parse_args(arguments)
    with threadpool_limits(limits=1, user_api="blas"):
        for one in ALL:
            if one.__name__ in options.names:
                for name, value in one(options.scale).items():
                    print(f"{one.__name__}, {name}: {value:.4g}", flush=True)


if __name__ == "__main__":
    main()
