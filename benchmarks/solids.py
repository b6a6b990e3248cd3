"""A slider-crank whose rod is meshed: a part trained alone, beside coarser meshes and the rod by Craig
and Bampton, at their errors; and a bar of solids that is bent at its natural frequency, in full and
reduced, as in an example of libROM.

    python benchmarks/solids.py [--size 2.8] [--coarse 12 8 6 4.5] [--modes 6 20]

Sizes of cells in mm; the meshes are built by `meshes/build_solids.py`, which needs gmsh: `--gmsh` names
a Python that has it. Errors are the largest differences from the motion with the finest mesh, over
the range there: of the von Mises stress at the fillets, the place of the piston and the torque of the
drive. CPU seconds are the least of two runs, of full models of one.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import skfem
from threadpoolctl import threadpool_limits

from fmbs_skfem import scenes, studies
from fmbs_skfem.bodies import Body, Material
from fmbs_skfem.bodies.from_matrices import Coupling, from_matrices
from fmbs_skfem.bodies.solids import solid_law
from fmbs_skfem.bodies.solids.solid_body import solid_body
from fmbs_skfem.dynamics import Trajectory, integrate, outputs
from fmbs_skfem.dynamics.near_state.linear import linearise
from fmbs_skfem.parts import condensation, static_states
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.parts.excitation import Excitation
from fmbs_skfem.reduction import snapshots
from fmbs_skfem.scenes import Scene, build
from fmbs_skfem.shapes.solids import recovery, solid, solid_meshes
from fmbs_skfem.shapes.solids.solid import Solid
from fmbs_skfem.systems import assemble, finer_systems

ROOT = Path(__file__).resolve().parents[1]
STEEL = Material(210e9, 7850.0, 0.3)
RIMS = {"A": ("big", (0.0, 0.0, 0.0)), "B": ("small", (0.16, 0.0, 0.0))}
TITLE = "# A slider-crank with a meshed rod\n\nWritten by `benchmarks/solids.py`: errors over the range of the motion with the finest mesh."
READ = {"stress": "fillet_von_mises", "piston": "B_x", "torque": "torque_torque"}
Values = dict[str, np.ndarray]
BAR = """\
schema: 1
dimension: 3
bodies:
  bar:
    type: solid
    mesh: bar.msh
    material: {young_modulus: 200 MPa, density: 1000, poisson_ratio: 0.3}
    rims: {left: left}
    averages: {right: right}
joints: {hold: {type: clamp, at: bar.left}}
loads: {push: {type: point_force, at: bar.right, force: [0, 0, 2 N], history: "sin(22.6 * t)"}}
outputs:
  r: {type: displacement, at: bar.right}
  v: {type: velocity, at: bar.right}
  s: {type: recovered_stress, of: bar, group: left}
analysis: {type: dynamic, duration: 1 s, step: 4 ms}
reduction: {tolerance: 1e-10, snapshots: 8 ms, hyper_reduction: {tolerance: 1e-3}}
"""


def scenes_of(size: float, folder: Path, gmsh: str) -> tuple[Scene, Scene]:
    """The scene of the example with cells of a size [mm], and one that reads no stress."""
    name = folder / f"rod_{size:g}.msh"
    builder = ROOT / "meshes" / "build_solids.py"
    subprocess.run([gmsh, builder, f"{1e-3 * size}", name], check=True, stdout=subprocess.DEVNULL)
    text = (ROOT / "examples" / "con_rod.yaml").read_text(encoding="utf-8")
    whole = text.replace("../meshes/con_rod_solid.msh", name.name)
    plain = "\n".join(
        line for line in whole.splitlines() if not line.startswith(("  fillet:", "pictures:"))
    )
    found = []
    for word, content in (("whole", whole), ("plain", plain)):
        path = folder / f"rod_{size:g}_{word}.yaml"
        path.write_text(content, encoding="utf-8")
        found.append(scenes.read(path))
    return found[0], found[1]


def rod_of(scene: Scene) -> Body:
    """The rod of a scene."""
    return next(one for one in build.parts(scene) if one.name == "rod")


def moved(scene: Scene, rod: Body, times: int = 1) -> tuple[Trajectory, float]:
    """The motion with a rod, and the least CPU time of some runs [s]."""
    analysis = build.dynamic(scene)
    bodies = [rod if one.name == "rod" else one for one in build.parts(scene)]
    system = build.of_parts(scene, bodies, pictures=False)
    form = finer_systems.unchecked(build.chosen_form(scene, system))
    spent = []
    for _ in range(times):
        begun = time.process_time()
        motion = integrate(form, analysis.scheme, analysis.duration)
        spent.append(time.process_time() - begun)
    return motion, min(spent)


def read(motion: Trajectory) -> Values:
    """The outputs that are compared."""
    found = outputs(motion)
    return {name: found[column] for name, column in READ.items() if column in found}


def stress_of_nodes(motion: Trajectory, rod: Body, whole: Body) -> np.ndarray:
    """The largest von Mises stress (s,) at the fillets, of a rod of matrices by the places of its
    nodes.
    """
    shape = whole.space
    assert isinstance(shape, Solid)
    assert whole.cells is not None
    rows = recovery.mean_gradients(shape, solid.nodes_of("rod", shape, "fillet"))
    (first, last) = next((a, b) for name, a, b in motion.system.coordinates if name == "rod")
    q = snapshots(motion).q[:, first:last]
    r = np.einsum("nb,sbc->snc", rod.spread.toarray(), q.reshape(len(q), -1, 3))  # type: ignore[union-attr]
    F = np.stack([rows @ one for one in r]).reshape(len(r), -1, 9)
    numbers = whole.cells.section[:-1, 0, 0]
    u = np.ascontiguousarray(F.transpose(2, 1, 0))
    stress = solid_law.stresses(whole.cells.law, numbers[:, None, None], u)
    return np.asarray(solid_law.von_mises(stress).max(axis=0))


def of_matrices(whole: Body, modes: int) -> Body:
    """The rod by Craig and Bampton from the matrices of its mesh."""
    shape = whole.space
    assert isinstance(shape, Solid)
    loose = solid_body("rod", shape, STEEL)
    K = linearise(assemble([loose], pictures=False)).stiffness
    sets = {}
    for name, (face, center) in RIMS.items():
        nodes, weights = solid.coupled("rod", shape, face)
        sets[name] = Coupling(tuple(nodes.tolist()), True, center, tuple(weights.tolist()))
    origin = np.array([0.04, 0.0, 0.0])
    body = from_matrices("rod", shape.reference, K, loose.mass, interfaces=sets, origin=origin)
    return condensation.condense(body, modes, checked=False)


def trained(whole: Body) -> tuple[Body, float]:
    """The rod as a part of small strains that is trained alone, and the CPU time of that [s]."""
    begun = time.process_time()
    states = static_states.find(whole, Excitation(strain=1e-3))[0]
    part = part_files.train(whole, states, small_strains=True)
    return part.body, time.process_time() - begun


def resonance(folder: Path) -> str:
    """What a bar that is shaken at its first frequency costs, and how far its reduced model errs."""
    bar = skfem.MeshTet.init_tensor(np.linspace(0, 1, 21), *[np.linspace(0, 0.05, 3)] * 2)
    ends = {"left": lambda x: x[0] < 1e-9, "right": lambda x: x[0] > 1.0 - 1e-9}
    solid_meshes.write(solid_meshes.from_skfem(bar.with_boundaries(ends)), folder / "bar.msh")
    (folder / "bar.yaml").write_text(BAR, encoding="utf-8")
    found = studies.reduce(folder / "bar.yaml").report
    times = found["cpu_s_full"] / found["cpu_s"]
    parts = {
        name: found["output_errors"][name]["relative"] for name in ("r_z", "v_z", "s_von_mises")
    }
    told = ", ".join(f"{name} {part:.2g}" for name, part in parts.items())
    size = f"{found['dofs_full']} unknowns {found['cpu_s_full']:.3g} s, {found['dofs']} unknowns {1e3 * found['cpu_s']:.3g} ms"
    return f"A bar bent at its first frequency: {size}, {times:.3g} times as fast; errors over the range: {told}."


def errors(found: Values, reference: Values) -> list[str]:
    """Largest differences over the ranges of the reference [%]."""
    return [
        f"{100.0 * np.abs(found[name] - one).max() / np.ptp(one):.2g}"
        for name, one in reference.items()
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the table into `results/solids.md`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=float, default=2.8)
    parser.add_argument("--coarse", type=float, nargs="*", default=[12.0, 8.0, 6.0, 4.5])
    parser.add_argument("--modes", type=int, nargs="*", default=[6, 20])
    parser.add_argument("--gmsh", default=sys.executable)
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name, threadpool_limits(limits=1, user_api="blas"):
        folder = Path(name)
        fine, plain = scenes_of(options.size, folder, options.gmsh)
        whole = rod_of(fine)
        motion, cpu = moved(fine, whole)
        reference = read(motion)
        rows = [
            [
                f"full, {options.size:g} mm",
                str(whole.reference.size),
                "",
                "",
                "",
                f"{cpu:.3g}",
                "",
                "1",
            ]
        ]

        def add(name: str, body: Body, found: Values, spent: float, training: float | None) -> None:
            told = "" if training is None else f"{training:.3g}"
            rows.append(
                [
                    name,
                    str(body.reference.size),
                    *errors(found, reference),
                    f"{spent:.3g}",
                    told,
                    f"{cpu / spent:.3g}",
                ]
            )
            print(rows[-1], flush=True)

        part, training = trained(whole)
        every = replace(part, linear=None, spare=None)
        for name, body in (("part of small strains", part), ("part of any strains", every)):
            motion, spent = moved(fine, body, 2)
            add(f"{name}, trained alone", body, read(motion), spent, training)
        for modes in options.modes:
            begun = time.process_time()
            body = of_matrices(whole, modes)
            training = time.process_time() - begun
            motion, spent = moved(plain, body, 2)
            found = {"stress": stress_of_nodes(motion, body, whole), **read(motion)}
            add(f"Craig and Bampton, {modes} modes", body, found, spent, training)
        shaken = resonance(folder)
        for size in options.coarse:
            scene = scenes_of(size, folder, options.gmsh)[0]
            body = rod_of(scene)
            motion, spent = moved(scene, body)
            add(f"full, {size:g} mm", body, read(motion), spent, None)
    head = [
        "model",
        "unknowns",
        *(f"{name} [%]" for name in reference),
        "CPU [s]",
        "made in [s]",
        "times as fast",
    ]
    lines = [head, ["---"] * len(head), *rows]
    table = "\n".join(f"| {' | '.join(row)} |" for row in lines)
    (ROOT / "benchmarks" / "results" / "solids.md").write_text(
        f"{TITLE}\n\n{table}\n\n{shaken}\n", encoding="utf-8"
    )
    print(f"{table}\n{shaken}")


if __name__ == "__main__":
    main()
