"""The same motion wherever a mechanism stands, however it is turned, numbered, ordered, measured or
cut into pieces.

Examples are moved and turned as a whole, their meshes renumbered and refined, their parameters set
to the values that they have; generated chains of cables and rigid bodies are built again in other
units, in another order, along reversed lines, with nodes of other numbers, cut in two, and reduced.
`--hypothesis-seed` and INVARIANCE=1000 in the environment give a longer run.
"""

from __future__ import annotations

import functools
import os
import re
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
import threadpoolctl
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from fmbs_skfem import bodies, reduction, scenes
from fmbs_skfem.bodies.body import Body
from fmbs_skfem.bodies.rigid import rigid
from fmbs_skfem.core import remembered_files
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, Trajectory, integrate, outputs
from fmbs_skfem.dynamics.outputs import lifted
from fmbs_skfem.scenes import build
from fmbs_skfem.shapes import meshes
from fmbs_skfem.shapes.meshes import LineMesh
from fmbs_skfem.shapes.msh import MshCells, Raw
from fmbs_skfem.systems import At, System, assemble, assembly, eliminate
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.system import in_scene, sizes

from .. import models

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STEPS = 40
#: examples of which two steps, and one change of all parameters, are enough
LARGE = (
    "gripper",
    "deep_arch",
)
COARSE = {"deep_arch": 4}  #: cells of beams whose whole path is solved
#: a turn of 90 degrees about z
QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
#: fields of joints and loads
POINTS, VECTORS = (
    ("to",),
    ("direction", "axis", "force", "acceleration", "moment"),
)
MANY = int(os.environ.get("INVARIANCE", "40"))


def states(motion: Trajectory) -> np.ndarray:
    """Vectors of all bodies from the origin of the scene (s, b, c)."""
    q = in_scene(motion.system, lifted(motion)[0])
    return q.reshape(len(q), -1, motion.system.dim)


def apart(one: np.ndarray, other: np.ndarray, system: System) -> float:
    """Largest distance of two motions (s, b, c) over the size of the mechanism."""
    full = system.full or system
    return float(sizes(full, (one - other).reshape(len(one), -1)).max()) / full.scale


def placed(part: Any, R: np.ndarray, shift: np.ndarray) -> Any:
    """A body, joint or load turned by R and moved."""
    if isinstance(part, Body):
        reference = part.reference @ R.T + np.outer(part.constant, shift)
        return replace(part, reference=reference)
    found = {}
    for field in fields(part):
        value = getattr(part, field.name)
        if not isinstance(value, tuple | list | np.ndarray) or len(value) != len(R):
            continue
        if field.name in POINTS:
            found[field.name] = tuple(R @ np.asarray(value, dtype=float) + shift)
        elif field.name in VECTORS and not isinstance(part, loads.Follower):
            found[field.name] = tuple(R @ np.asarray(value, dtype=float))
    return replace(part, **found)


def example(
    name: str, R: np.ndarray | None = None, shift: np.ndarray | None = None
) -> tuple[System, GeneralizedAlpha]:
    """The system of an example, turned and moved."""
    scene = scenes.read(EXAMPLES / name)
    d = scene.dimension
    R, shift = np.eye(d) if R is None else R[:d, :d], np.zeros(d) if shift is None else shift[:d]
    parts: list[Any] = []

    def moved(many: Any, joined: Any, loaded: Any, *rest: Any, **more: Any) -> System:
        parts.extend(placed(part, R, shift) for part in many)
        return ASSEMBLE(
            parts,
            [placed(j, R, shift) for j in joined],
            [placed(one, R, shift) for one in loaded],
            *rest,
            **more,
        )

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(assembly, "assemble", moved)
        full = build.system(scene)
    analysis = build.dynamic(scene)
    return build.chosen_form(scene, full), GeneralizedAlpha(analysis.step, analysis.rho_inf)


ASSEMBLE = assembly.assemble


@pytest.mark.parametrize(
    "name",
    [
        "double_pendulum.yaml",
        "spin_up.yaml",
        "four_bar.yaml",
        "hanging_mass.yaml",
        "crank_slider_coarse.yaml",
    ],
)
@pytest.mark.parametrize("shift", [(1e4, -1e4, 1e4), (0.0, 0.0, 0.0)], ids=["10 km away", "turned"])
def test_examples_do_not_depend_on_the_frame(name: str, shift: tuple[float, float, float]) -> None:
    """To 1e-7 of their size; turned by 90 degrees where nothing in them is bound to an axis of the
    scene.
    """
    far = np.array(shift)
    bound = name in ("hanging_mass.yaml",)  # its support is driven along x
    R = np.eye(3) if far.any() or bound else QUARTER
    system, scheme = example(name)
    other, _ = example(name, R, far)
    one, two = (integrate(s, scheme, STEPS * scheme.step) for s in (system, other))
    d = system.dim
    unit = system.unit[None, :, None]
    back = (states(two) - unit * far[:d]) @ R[:d, :d]
    assert apart(states(one), back, system) < 1e-7


def solved(scene: scenes.Scene, steps: int = STEPS, cells: int | None = None) -> Trajectory:
    """Equilibria of a static scene, some steps of another one, with the Newton iteration of the
    scene.
    """
    system = build.chosen_form(scene, build.system(scene, cells))
    if scene.analysis.word == "static":
        return scene.analysis.solve(system)
    analysis = build.dynamic(scene)
    scheme = GeneralizedAlpha(analysis.step, analysis.rho_inf)
    return integrate(system, scheme, steps * analysis.step, analysis.newton)


def positions(motion: Trajectory) -> np.ndarray:
    """All outputs that are positions (s, c) [m]."""
    places = {
        column
        for one in motion.system.outputs.values()
        if one.kind == "position"
        for column in one.columns
    }
    return np.column_stack([values for name, values in outputs(motion).items() if name in places])


def shuffled(raw: Raw, seed: int) -> Raw:
    """What a mesh file says, its nodes and cells in another order and with other numbers."""
    random = np.random.default_rng(seed)
    rows = random.permutation(len(raw.points))
    number = dict(
        zip(
            raw.numbers[rows].tolist(),
            random.permutation(np.arange(1, len(rows) + 1) * 7).tolist(),
            strict=True,
        )
    )
    renamed = np.vectorize(number.__getitem__, otypes=[np.int64])

    def cells(known: MshCells) -> MshCells:
        order = random.permutation(len(known.nodes))
        place = np.argsort(order)
        nodes = renamed(known.nodes[order]) if len(order) else known.nodes
        return MshCells(
            nodes,
            known.numbers[order],
            {name: np.sort(place[rows]) for name, rows in known.groups.items()},
        )

    return replace(
        raw,
        points=raw.points[rows],
        numbers=renamed(raw.numbers[rows]),
        point_groups={name: renamed(nodes) for name, nodes in raw.point_groups.items()},
        lines=cells(raw.lines),
        triangles=cells(raw.triangles),
        quads=cells(raw.quads),
    )


@pytest.mark.parametrize(
    "name",
    [
        "double_pendulum.yaml",
        "spin_up.yaml",
        "four_bar.yaml",
        "hanging_mass.yaml",
        "crank_slider_coarse.yaml",
        "plate.yaml",
    ],
)
def test_examples_do_not_depend_on_the_numbers_of_nodes_and_cells(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To 1e-10 of their size."""
    scene, load, read = scenes.read(EXAMPLES / name), meshes.load, []
    one = solved(scene)

    def shuffling(*arguments: Any) -> Raw:
        read.append(arguments[0])
        return shuffled(load(*arguments), len(read))

    monkeypatch.setattr(meshes, "load", shuffling)
    monkeypatch.setattr(remembered_files, "KNOWN", OrderedDict())  # what was read before
    other = solved(scene)
    assert len(read) >= len(build.parts(scene)) - 1
    assert np.abs(positions(one) - positions(other)).max() < 1e-10 * one.system.scale


@pytest.mark.parametrize(
    "name, cells, order, digits",
    [
        ("spin_up.yaml", 4, 3.0, 1e-7),
        ("four_bar.yaml", 4, 3.0, 1e-7),
        ("double_pendulum.yaml", 4, 2.5, 1e-5),
        ("hanging_mass.yaml", 32, 2.5, 1e-5),
    ],
)
def test_refined_examples_converge(name: str, cells: int, order: float, digits: float) -> None:
    """Over 0.4 s, refined three times; the cable bends sharply at its mass, over sqrt(EI / T) = 5
    cm.
    """
    scene = scenes.read(EXAMPLES / name)
    steps = round(0.4 / build.dynamic(scene).step)
    found = [
        positions(solved(scene, steps, cells)) for cells in (cells, 2 * cells, 4 * cells, 8 * cells)
    ]
    change = [float(np.abs(fine - coarse).max()) for coarse, fine in pairwise(found)]
    assert all(after < before / 2**order for before, after in pairwise(change))
    assert change[-1] < digits * build.system(scene, 4).scale


@dataclass(frozen=True)
class Chain:
    """A chain of links that hangs at a point and falls: what it is, and how it is written down."""

    kinds: tuple[str, ...]  #: of the links: cable or rigid
    dim: int
    angle: float  #: of the first link with the x-axis [rad]; every further one turns by as much
    payload: bool
    unit: float = 1.0  #: lengths are numbers of 1/unit metres
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: float = 0.0  #: of the scene about z [rad]
    reverse: bool = False  #: lines run from the far end
    swapped: bool = False  #: order of bodies and joints
    cut: bool = False  #: cables in two pieces, welded
    mixed: bool = False  #: nodes and cells of the lines in another order
    cells: int = 6

    def system(self) -> System:
        """With all lengths times `unit`; masses and times stay."""
        L, d = self.unit, self.dim
        E, rho = 1e8 / L, 1500.0 / L**3  # Pa = kg/(m s2)
        section, material = bodies.Circular(0.01 * L), bodies.Material(E, rho)
        R = rotation(self.turn)
        parts: list[Body] = []
        held: list[Any] = []
        at: Any = tuple((np.array(self.shift) * L)[:d])
        foot = np.array(self.shift) * L
        for k, kind in enumerate(self.kinds):
            a = self.angle * (k + 1)
            tip = foot + R @ np.array([np.cos(a), np.sin(a), 0.0]) * 0.5 * L
            name = f"link{k}"
            if kind == "rigid":
                middle = 0.5 * (foot + tip)
                places = {"a": tuple(foot[:d]), "b": tuple(tip[:d])}
                inertia: Any = 0.02 * L**2 if d == 2 else np.eye(3) * 0.02 * L**2
                parts.append(rigid(name, 0.4, inertia, tuple(middle[:d]), dim=d, places=places))
                first, last = At(name, "a"), At(name, "b")
            else:
                pieces = [(name, foot, tip)]
                if self.cut:
                    pieces = [
                        (name, foot, 0.5 * (foot + tip)),
                        (f"{name}b", 0.5 * (foot + tip), tip),
                    ]
                for piece, start, end in pieces:
                    ends = (end, start) if self.reverse else (start, end)
                    mesh = models.segment(self.cells // len(pieces), tuple(ends[0]), tuple(ends[1]))
                    mesh = mixed(mesh) if self.mixed else mesh
                    parts.append(bodies.cable(piece, mesh, section, material, dim=d))
                near, far = ("right", "left") if self.reverse else ("left", "right")
                if self.cut:
                    held.append(joints.Weld(f"{name} weld", At(name, far), At(f"{name}b", near)))
                first, last = At(name, near), At(pieces[-1][0], far)
            held.append(joints.Pin(f"pin{k}", first, at))
            foot, at = tip, last
        if self.payload:
            parts.append(bodies.point_mass("payload", 0.3, foot[:d]))
            held.append(joints.Pin("hook", At("payload", "center"), at))
        gravity = R @ np.array([0.0, -9.81, 0.0]) * L
        if self.swapped:
            parts, held = parts[::-1], held[::-1]
        return eliminate(assemble(parts, held, [loads.Gravity(tuple(gravity[:d]))]))

    def ends(self, motion: Trajectory) -> np.ndarray:
        """Positions of all link ends in the unturned frame in metres (s, x, c)."""
        system = motion.system
        q = in_scene(system, lifted(motion)[0])
        found = []
        for k, kind in enumerate(self.kinds):
            name = f"link{k}b" if kind == "cable" and self.cut else f"link{k}"
            line = next(one for one in system.lines if one.name == name)
            points = np.asarray(line.samples[: line.samples.shape[0] // 3] @ q.T).T.reshape(
                len(q), -1, self.dim
            )
            found.append(points[:, 0 if self.reverse and kind == "cable" else -1])
        R = rotation(self.turn)[: self.dim, : self.dim]
        return (
            (np.stack(found, axis=1) - np.array(self.shift)[: self.dim] * self.unit) @ R / self.unit
        )


def mixed(mesh: LineMesh) -> LineMesh:
    """The mesh with its nodes and cells in another order."""
    random = np.random.default_rng(len(mesh.cells))
    rows, order = random.permutation(len(mesh.points)), random.permutation(len(mesh.cells))
    place = np.argsort(rows)
    groups = {name: place[nodes] for name, nodes in mesh.point_groups.items()}
    return replace(
        mesh, points=mesh.points[rows], cells=place[mesh.cells[order]], point_groups=groups
    )


def rotation(angle: float) -> np.ndarray:
    """About z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


CHAINS = st.builds(
    Chain,
    kinds=st.lists(st.sampled_from(["cable", "rigid"]), min_size=1, max_size=3).map(tuple),
    dim=st.sampled_from([2, 3]),
    angle=st.floats(-1.0, 1.0).map(lambda x: round(x, 2)),
    payload=st.booleans(),
)
SCHEME, TIGHT = GeneralizedAlpha(2e-3), Newton(1e-13)
CHANGES: dict[str, tuple[Callable[[Chain], Chain], float]] = {
    "moved": (lambda one: replace(one, shift=(3000.0, -7000.0, 0.0)), 1e-7),
    "turned": (lambda one: replace(one, turn=1.234), 1e-8),
    "millimetres": (lambda one: replace(one, unit=1000.0), 1e-8),
    "swapped": (lambda one: replace(one, swapped=True), 1e-8),
    "reversed": (lambda one: replace(one, reverse=True), 1e-8),
    "renumbered": (lambda one: replace(one, mixed=True), 1e-10),
    "cut": (lambda one: replace(one, cut=True), 1e-8),
    "refined": (lambda one: replace(one, cells=24), 2e-3),
}


def run(chain: Chain) -> np.ndarray:
    """Ends of the links at all instants (s, x, c) [m]."""
    return chain.ends(integrate(chain.system(), SCHEME, STEPS * SCHEME.step, TIGHT))


@settings(max_examples=MANY, deadline=None, derandomize=MANY < 100)
@given(chain=CHAINS, change=st.sampled_from(sorted(CHANGES)))
def test_chains_move_alike_however_they_are_written_down(chain: Chain, change: str) -> None:
    make, allowed = CHANGES[change]
    one, other = run(chain), run(make(chain))
    assert np.abs(one - other).max() < allowed


@pytest.mark.parametrize(
    "change", ["moved", "turned", "millimetres", "swapped", "reversed", "renumbered"]
)
def test_reduced_models_move_alike(change: str) -> None:
    """Trained and run in both ways of writing the chain down: the same number of modes, the same
    motion to 1e-6 m.
    """
    one, other = known(FALLING), trained(CHANGES[change][0](FALLING))
    assert one[0] == other[0]
    assert np.abs(one[1] - other[1]).max() < 1e-6


@pytest.mark.parametrize("eliminated", [False, True])
@pytest.mark.parametrize("unit", [1e-6, 1e8])
def test_reduced_models_have_the_same_joints_in_every_unit(unit: float, eliminated: bool) -> None:
    """Bodies of half a micrometre and of 50 000 km keep the rows of those of half a metre, and move
    as they do to 1e-12 of it.
    """
    one, other = known(FALLING, eliminated), trained(replace(FALLING, unit=unit), eliminated)
    assert one[::2] == other[::2]
    assert np.abs(one[1] - other[1]).max() < 1e-12


FALLING = Chain(("cable", "rigid", "cable"), 2, 0.4, True)


Trained: TypeAlias = tuple[list[tuple[str, int]], np.ndarray, list[tuple[str, str]]]


def trained(chain: Chain, eliminated: bool = False) -> Trained:
    """Numbers of modes of the chain's parts, ends of its links (s, x, c) [m] as the model reduced
    to them moves, and its rows.
    """
    system = chain.system()
    raw = system.full
    assert raw is not None
    data = reduction.snapshots(integrate(system, SCHEME, STEPS * SCHEME.step, TIGHT))
    parts = reduction.body_level(raw)
    bases = reduction.bases(raw, data, parts, 1e-12)
    small = reduction.reduce_system(raw, parts, bases, eliminated, data.q)
    modes = sorted((name, basis.modes.shape[1]) for name, basis in bases.items())
    return (
        modes,
        chain.ends(integrate(small, SCHEME, STEPS * SCHEME.step, TIGHT)),
        list(small.constraints.names),
    )


known = functools.cache(trained)


@pytest.mark.parametrize("cells", [6, 96])
def test_threads_of_the_linear_algebra_change_nothing(cells: int) -> None:
    """Full to 1e-10 m, reduced in a training of its own to 1e-6 m; BLAS shares the work on large
    arrays only.
    """
    chain, found = replace(FALLING, dim=3, cells=cells), []
    for threads in (1, 2):
        with threadpoolctl.threadpool_limits(limits=threads, user_api="blas"):
            assert {
                pool["num_threads"]
                for pool in threadpoolctl.threadpool_info()
                if pool["user_api"] == "blas"
            } == {threads}
            found.append((run(chain), *trained(chain)))
    (one, modes, small, _), (two, others, little, _) = found
    assert np.abs(one - two).max() < 1e-10
    assert modes == others
    assert np.abs(small - little).max() < 1e-6


SCENES = sorted(EXAMPLES.glob("*.yaml"))
COPIES = ("crank_slider",)  #: scenes that are solved by a coarser mesh of the same scene
PARAMETERS = re.compile(
    r"^parameters:.*^analysis:\s*\{?\s*type: (dynamic|static)\b", flags=re.DOTALL | re.MULTILINE
)
SOLVED = [
    path
    for path in SCENES
    if path.stem not in COPIES and PARAMETERS.search(path.read_text(encoding="utf-8"))
]


def written(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
    return found


def test_all_examples_with_parameters_are_solved_below() -> None:
    """They are found by their texts, as reading all of them takes a second of every process."""
    wanted = [
        path
        for path in SCENES
        if "parameters" in (one := written(path))
        and one["analysis"]["type"] in ("dynamic", "static")
    ]
    assert [path for path in wanted if path.stem not in COPIES] == SOLVED


@pytest.mark.parametrize("path", SOLVED, ids=lambda path: path.stem)
def test_parameters_set_to_their_own_values_change_no_bit(path: Path) -> None:
    """As with `--set NAME=VALUE` by the text of the file, one after the other and all at once."""
    entries = written(path)["parameters"].items()
    known = {name: entry["value"] if isinstance(entry, dict) else entry for name, entry in entries}
    texts, large = {name: str(value) for name, value in known.items()}, path.stem in LARGE
    steps = 2 if large else STEPS
    cells = COARSE.get(path.stem)
    one = solved(scenes.read(path), steps, cells)
    for changed in (texts, *([] if large else [{name: text} for name, text in texts.items()])):
        other = solved(scenes.read(path, changed), steps, cells)
        for name in ("times", "x", "v", "a", "multipliers"):
            assert np.array_equal(getattr(one, name), getattr(other, name))
