"""Files with a right checksum whose arrays do not fit: every dataset is damaged in every way, and
refused by name.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.bodies import sections
from fmbs_skfem.bodies.plate import plate
from fmbs_skfem.core.errors import CorruptFile
from fmbs_skfem.core.storage import container, validation
from fmbs_skfem.core.storage.container import FileKind
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate
from fmbs_skfem.families import parametric_model
from fmbs_skfem.families.parametric_model import ParametricModel
from fmbs_skfem.reduction import affine, files
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.hyper import polynomial
from fmbs_skfem.reduction.parameters import Parameter
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.scenes import build
from fmbs_skfem.systems import At, System, assemble
from fmbs_skfem.systems.connections import joints
from fmbs_skfem.systems.forces import loads
from fmbs_skfem.systems.measures import line_stresses, probes
from fmbs_skfem.systems.system import change_coordinates
from tests import models
from verification.plates import rectangle

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SCHEME, DURATION = GeneralizedAlpha(1e-3), 0.02
FAR = 10**9
Array = np.ndarray[Any, Any]


def pulled(tip: At) -> list[Any]:
    """Every kind of load on a slope or a point of a beam in the plane."""
    history = of_time("1 - exp(-t / 0.02)")
    return [
        loads.PointForce("force", tip, (0.0, 0.5), history),
        loads.Follower("follower", tip, (0.0, 0.1), history),
        loads.Moment("moment", tip, 0.01, history),
        loads.TorsionSpring("spring", tip, stiffness=0.1, damping=0.01),
    ]


def beam(E: float = 1e9) -> System:
    return models.cantilever(
        2,
        pulled,
        section=models.SECTION,
        material=sections.Material(E, 1800.0),
        all_multipliers=True,
    )


def squeezed(system: System, modes: int) -> System:
    """The system in so many random unknowns around its start: small, dense, and of every type that
    a reduced one has.
    """
    V = np.linalg.qr(np.random.default_rng(1).normal(size=(system.size, modes)))[0]
    return change_coordinates(system, V, system.x0)


def sheet() -> System:
    """A planar plate of a few cells, held at an edge, with a stress as output."""
    body = plate("sheet", rectangle("bfs", 2, 1), 0.01, sections.Material(7e10, 2700.0, 0.3), dim=2)
    held = [joints.Edge("held", "sheet", ("left",))]
    return assemble(
        [body],
        held,
        outputs={"stress": line_stresses.Stress(At("sheet", "a")), "energy": probes.Energy()},
    )


SYSTEMS: dict[str, Callable[[], System]] = {
    "beam": beam,
    "sampled beam": lambda: squeezed(beam(), 5),
    "polynomial of a sheet": lambda: polynomial.exact(squeezed(sheet(), 3)),
}


def parts(path: Path) -> tuple[FileKind, bytes, list[Array]]:
    """Kind, tree and arrays of a file."""
    kind = replace(files.KIND, title=path.read_bytes().split(b"\n", 1)[0].decode())
    with h5py.File(path) as file:
        return (
            kind,
            file["tree"][()].tobytes(),
            [file[f"arrays/{k}"][()] for k in range(len(file["arrays"]))],
        )


def sealed(path: Path, kind: FileKind, tree: bytes, arrays: list[Array]) -> Path:
    """A file of any content, with a checksum that fits."""
    with h5py.File(path, "w", userblock_size=container.HEADER) as file:
        file["tree"] = np.frombuffer(tree, dtype=np.uint8)
        group = file.create_group("arrays")
        for number, array in enumerate(arrays):
            group[str(number)] = array
    body = path.read_bytes()[container.HEADER :]
    path.write_bytes(container.header(body, kind) + body)
    return path


def refusal(path: Path) -> str | None:
    """What a file is refused with, or nothing."""
    try:
        files.load(path)
    except CorruptFile as problem:
        return str(problem)
    return None


def damaged(array: Array) -> Iterator[tuple[str, Array]]:
    """An array cut short, of another rank and another type, with an index out of range, with a
    number that is none.
    """
    yield "rank", array[None]
    if array.size:
        yield "cut", array[..., :-1]
    yield "type", array.astype(np.float32 if array.dtype.kind == "f" else np.float64)
    for place, value in zip(
        (0, -1), (np.nan, np.inf) if array.dtype.kind == "f" else (-FAR, FAR), strict=True
    ):
        if array.size:
            other = array.copy()
            other.reshape(-1)[place] = value
            yield f"{value}", other


def used(tree: bytes, name: str) -> set[int]:
    """Numbers of the arrays that stand in a part of the tree."""
    found: set[int] = set()

    def walk(item: Any) -> None:
        if isinstance(item, dict):
            found.update([item["array"]] if "array" in item else [])
        for value in (
            item.values() if isinstance(item, dict) else item if isinstance(item, list) else ()
        ):
            walk(value)

    walk(json.loads(tree)[name])
    return found


@pytest.mark.parametrize("name", SYSTEMS)
def test_every_damaged_array_is_refused_by_name(name: str, tmp_path: Path) -> None:
    system = SYSTEMS[name]()
    path = files.save(system, tmp_path / "model.rom")
    kind, tree, arrays = parts(path)
    assert used(tree, "system") == set(range(len(arrays)))
    refused = 0
    for number, array in enumerate(arrays):
        for way, other in damaged(array):
            sealed(path, kind, tree, [*arrays[:number], other, *arrays[number + 1 :]])
            message = refusal(path)
            if message is None:  # the number of a cell beyond all cells, which nothing reads
                assert way == f"{FAR}", f"array {number}, {way}"
                one, two = (integrate(s, SCHEME, DURATION).x for s in (system, files.load(path)))
                assert np.array_equal(one, two)
                continue
            assert ": system." in message, f"array {number}, {way}: {message}"
            refused += 1
    assert refused > 3 * len(arrays)


@pytest.fixture(scope="module")
def rom() -> ParametricModel:
    raw = beam()
    data = galerkin.snapshots(integrate(raw, SCHEME, DURATION))
    components = component.system_level(raw)
    bases = galerkin.bases(raw, data, components, modes=4)
    box = (Parameter("E", 5e8, 2e9, value=1e9),)
    return ParametricModel(
        affine.fit(
            lambda values: Case(
                galerkin.reduce_system(beam(**values), components, bases), SCHEME, DURATION
            ),
            box,
        )
    )


def test_every_damaged_array_of_a_parametric_model(rom: ParametricModel, tmp_path: Path) -> None:
    path = parametric_model.save(rom, tmp_path / "model.rom")
    kind, tree, arrays = parts(path)
    text = tree.decode()
    own = used(
        json.dumps({"varying": json.loads(text)["model"]["fields"]["varying"]}).encode(), "varying"
    )
    own |= used(
        json.dumps({"nodes": json.loads(text)["model"]["fields"]["nodes"]}).encode(), "nodes"
    )
    assert len(own) > 3
    for number in own:
        for way, other in damaged(arrays[number]):
            sealed(path, kind, tree, [*arrays[:number], other, *arrays[number + 1 :]])
            with pytest.raises(
                CorruptFile, match=r"model\.rom: model\.(varying|nodes)\[\d+\]"
            ) as caught:
                parametric_model.load(path)
            assert caught.value.exit_code == 8, way


CHANGES = [
    (b'"dim": 2', b'"dim": 4', r"system\.dim: expected 2 or 3, got 4"),
    (b'"dim": 2', b'"dim":"a"', r"system\.dim: expected an integer, got 'a'"),
    (
        b'"beta": 0.0',
        b'"beta": NaN',
        r"system\.elastic\[0\]\.beta: expected a finite number, got nan",
    ),
    (
        b'"slice": [0, 5,',
        b'"slice": [0, 9,',
        r"columns: expected a range within 0 to 5, got slice\(0, 9, None\)",
    ),
    (
        b'"kind": "position"',
        b'"kind": "possession"',
        r"outputs\.tip\.kind: expected one of position.*, got 'possession'",
    ),
    (
        b'"tip_x"',
        b'",=cmd()"',
        r"system\.outputs: expected names that begin with a letter, .*got ',=cmd\(\)'",
    ),
    (
        b'["tip", {"type"',
        b'["=tip", {"type"',
        r"system\.outputs: expected names that begin with a letter, .*got '=tip'",
    ),
    (b'"moment_2"', b'"moment_9"', r"force law: expected one of .*, got 'moment_9'"),
    (
        b'"moment_2"',
        b'"moment_3"',
        r"loads\.forces\[\d\]\.numbers: expected an array \(1, 3\) of float64, got an array \(1, 1\)",
    ),
    (b'"exp"', b'"exq"', r"system\.signals\[0\]: expected a function of time, got 'exq'"),
    (
        b'"x0": {"array"',
        b'"x0": {"slice": [0, 1, 2], "erray"',
        r"system\.x0: expected a ndarray, got slice",
    ),
]


@pytest.mark.parametrize("old, new, message", CHANGES)
def test_texts_of_the_tree_that_do_not_fit_are_named(
    old: bytes, new: bytes, message: str, tmp_path: Path
) -> None:
    path = files.save(squeezed(beam(), 5), tmp_path / "model.rom")
    kind, tree, arrays = parts(path)
    assert old in tree
    sealed(path, kind, tree.replace(old, new, 1), arrays)
    with pytest.raises(CorruptFile, match=message):
        files.load(path)


@pytest.mark.parametrize(
    "name", ["crank_slider_coarse", "double_pendulum", "four_bar", "hanging_mass", "roof", "plate"]
)
def test_every_example_is_sound(name: str) -> None:
    """Cells, surfaces, springs, gears and driven joints pass, with all multipliers and eliminated."""
    scene = scenes.read(EXAMPLES / f"{name}.yaml")
    raw = build.system(scene)
    for system in (raw, build.chosen_form(scene, raw)):
        validation.check(system, "system")


@pytest.mark.parametrize("name", ["tree", "arrays", "arrays/0"])
def test_links_to_other_files_are_not_followed(name: str, tmp_path: Path) -> None:
    path = files.save(squeezed(beam(), 5), tmp_path / "model.rom")
    kind = parts(path)[0]
    other = tmp_path / "other.h5"
    other.write_bytes(path.read_bytes())
    with h5py.File(path, "r+") as file:
        del file[name]
        file[name] = h5py.ExternalLink(str(other), name)
    body = path.read_bytes()[container.HEADER :]
    path.write_bytes(container.header(body, kind) + body)
    with pytest.raises(CorruptFile, match="a link to elsewhere"):
        files.load(path)
