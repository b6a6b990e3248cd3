"""Files of NURBS surfaces: what comes back is what was written, and what a bad file is told."""

from __future__ import annotations

import copy
import importlib.util
import json
import textwrap
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fmbs_skfem.core import remembered_files
from fmbs_skfem.core.errors import InputError, MissingFeature
from fmbs_skfem.shapes import interfaces, nurbs, nurbs_file, surface
from fmbs_skfem.shapes.surface import Surface
from fmbs_skfem.shapes.table import check_table

HALF = float(np.sqrt(0.5))

#: A quarter of a cylinder of radius 2 and length 3.
QUARTER: dict[str, Any] = {
    "format": "fmbs-nurbs",
    "version": 1,
    "patches": [
        {
            "degree": [2, 1],
            "knots": [[0, 0, 0, 1, 1, 1], [0, 0, 1, 1]],
            "control": [[[0, 0, 2], [0, 3, 2]], [[2, 0, 2], [2, 3, 2]], [[2, 0, 0], [2, 3, 0]]],
            "weights": [[1, 1], [HALF, HALF], [1, 1]],
        }
    ],
    "points": {"tip": {"xi": [0.5, 1.0]}},
    "edges": {"rims": ["xi2_min", "xi2_max"]},
}


def saved(tmp_path: Path, data: Any, name: str = "a.json") -> Path:
    file = tmp_path / name
    file.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return file


def position(shape: Surface, name: str) -> np.ndarray:
    cell, xi1, xi2 = shape.points[name]
    return np.asarray(
        surface.sample(shape, np.array([cell]), np.array([[xi1, xi2]])) @ shape.reference
    )[0]


def radii(shape: Surface, axes: tuple[int, int] = (0, 2)) -> np.ndarray:
    table = surface.tabulate(shape)
    points = np.einsum("epb,ebc->epc", table.values[:, :, 0], shape.reference[shape.nodes])
    return np.hypot(points[..., axes[0]], points[..., axes[1]])


def patches_of(shape: Surface) -> Iterator[tuple[nurbs.Patch, np.ndarray]]:
    for name, patch in shape.space.patches.items():
        yield patch, shape.reference[shape.space.numbers[name]]


def same(a: Surface, b: Surface) -> None:
    """Equal to the last bit, places included."""
    for (one, first), (two, second) in zip(patches_of(a), patches_of(b), strict=True):
        assert (one.degree1, one.degree2) == (two.degree1, two.degree2)
        for x, y in ((one.knots1, two.knots1), (one.knots2, two.knots2), (first, second)):
            assert_array_equal(x, y)
        assert (one.weights is None) == (two.weights is None)
        if one.weights is not None and two.weights is not None:
            assert_array_equal(one.weights, two.weights)
    assert_array_equal(a.nodes, b.nodes)
    assert list(a.space.patches) == list(b.space.patches)
    assert a.points.keys() == b.points.keys()
    assert a.edges.keys() == b.edges.keys()
    for name in a.edges:
        assert_array_equal(a.edges[name], b.edges[name])
    for name in a.points:
        assert_allclose(position(a, name), position(b, name), atol=1e-14)


# --------------------------------------------------------------------------------------------------------------------- JSON
def test_a_quarter_cylinder(tmp_path: Path) -> None:
    shape = nurbs_file.read(saved(tmp_path, QUARTER))
    assert_allclose(radii(shape), 2.0, rtol=1e-14)
    assert_allclose(position(shape, "tip"), [2.0 * HALF, 3.0, 2.0 * HALF], rtol=1e-14)
    assert_array_equal(shape.edges["rims"], [[0, 0], [0, 2]])


def test_refined_and_in_millimetres(tmp_path: Path) -> None:
    shape = nurbs_file.read(saved(tmp_path, QUARTER), cells=4, degree=3, scale=1e-3)
    check_table(shape)
    assert shape.count == 49
    assert len(shape.edges["rims"]) == 8
    assert_allclose(radii(shape), 2e-3, rtol=1e-14)
    assert_allclose(position(shape, "tip"), [2e-3 * HALF, 3e-3, 2e-3 * HALF], rtol=1e-14)


def test_patches_of_different_degrees_are_raised_and_joined(tmp_path: Path) -> None:
    data = copy.deepcopy(QUARTER)
    flat = {
        "degree": [1, 1],
        "knots": [[0, 0, 1, 1]] * 2,
        "control": [[[-1, 0, 2], [-1, 3, 2]], [[0, 0, 2], [0, 3, 2]]],
    }
    data["patches"].append(flat)
    data["points"], data["edges"] = (
        {"tip": {"patch": "patch2", "xi": [0, 0]}},
        {"rim": ["patch1.xi2_min", "patch2.xi2_min"]},
    )
    shape = nurbs_file.read(saved(tmp_path, data))
    assert interfaces.common_edges(shape) == [("patch1.xi1_min", "patch2.xi1_max")]
    assert shape.count == 9 + 9 - 3
    assert_allclose(position(shape, "tip"), [-1, 0, 2])
    assert nurbs_file.read(saved(tmp_path, {**data, "join": False})).count == 18


@pytest.mark.parametrize("name", ["", "roof"])
def test_round_trip(tmp_path: Path, name: str) -> None:
    """One patch, with and without a name, with uneven weights and a name of our own."""
    patch, control = nurbs.cylinder_panel(25.0, 50.0, -0.7, 0.7, 3, 2, 3, 1)
    shape = nurbs.surface({name: patch}, {name: control})
    prefix = f"{name}." if name else ""
    both = np.concatenate([shape.edges[f"{prefix}xi1_min"], shape.edges[f"{prefix}xi1_max"]])
    shape = replace(
        shape,
        points={
            **shape.points,
            "middle": nurbs.place(shape, 0.5, 0.3, name),
            "end": nurbs.place(shape, 1.0, 1.0, name),
        },
        edges={**shape.edges, "supports": np.unique(both, axis=0)},
    )
    file = tmp_path / "roof.json"
    nurbs_file.write(file, shape)
    same(nurbs_file.read(file), shape)


@pytest.mark.parametrize("join", [True, False])
def test_round_trip_of_two_patches(tmp_path: Path, join: bool) -> None:
    patch, control = nurbs.rectangle(1.0, 2.0, 2, 3, 3, origin=(0.1, 0.2))
    shape = nurbs.surface(
        {"a": patch, "b": patch}, {"a": control, "b": control + np.array([1.0, 0.0])}, join=join
    )
    shape = replace(shape, points={**shape.points, "tip": nurbs.place(shape, 0.9, 0.1, "b")})
    file = tmp_path / "two.json"
    nurbs_file.write(file, shape)
    same(nurbs_file.read(file), shape)


def test_only_whole_sides_are_written(tmp_path: Path) -> None:
    shape = nurbs.surface(*nurbs.rectangle(1.0, 1.0, 2, 2))
    shape = replace(shape, edges={**shape.edges, "half": shape.edges["xi1_min"][:1]})
    with pytest.raises(
        InputError, match=r"edge 'half': expected whole sides of patches, got 1 sides of cells"
    ):
        nurbs_file.write(tmp_path / "a.json", shape)
    with pytest.raises(InputError, match=r"expected a surface of nurbs\.surface, got str"):
        nurbs_file.write(tmp_path / "a.json", replace(shape, space="other"))


# ---------------------------------------------------------------------------------------------------------------- bad files
def changed(path: str, value: Any) -> dict[str, Any]:
    """The quarter cylinder with one entry replaced, or removed where the value is `...`."""
    data = copy.deepcopy(QUARTER)
    keys = [int(key) if key.isdigit() else key for key in path.split("/")]
    place: Any = data
    for key in keys[:-1]:
        place = place[key]
    if value is ...:
        del place[keys[-1]]
    else:
        place[keys[-1]] = value
    return data


BAD = [
    ("format", "fmbs", r"format: expected 'fmbs-nurbs', version 1, got 'fmbs', version 1"),
    ("version", 2, r"format: expected 'fmbs-nurbs', version 1, got 'fmbs-nurbs', version 2"),
    ("patches", ..., r"expected the key 'patches'"),
    ("patches", [], r"patches: expected a list of 1 to 1000 patches, got a list of 0"),
    (
        "patches",
        [3],
        r"patches\[0\]: expected an object with the keys degree, knots, control, got 3",
    ),
    (
        "patches/0/knots",
        ...,
        r"patches\[0\]: expected the key 'knots', got the keys 'degree', 'control', 'weights'; add it",
    ),
    (
        "patches/0/weight",
        [],
        r"patches\[0\]: expected keys of .*, got 'weight'; did you mean 'weights'",
    ),
    (
        "patches/0/name",
        "a.b",
        r"patches\[0\]\.name: expected a name of letters, digits, _ and -.*got 'a\.b'",
    ),
    (
        "patches/0/degree",
        [2],
        r"patches\[0\]\.degree: expected two whole numbers from 1 to 10, got \[2\]",
    ),
    (
        "patches/0/degree",
        [2, 11],
        r"patches\[0\]\.degree: expected two whole numbers from 1 to 10, got \[2, 11\]",
    ),
    ("patches/0/degree", [2, True], r"patches\[0\]\.degree: expected two whole numbers"),
    ("patches/0/degree", [2.0, 1], r"patches\[0\]\.degree: expected two whole numbers"),
    (
        "patches/0/knots",
        [[0, 1]],
        r"patches\[0\]\.knots: expected two lists of knots, one a direction, got a list of 1",
    ),
    ("patches/0/knots/0", 4, r"patches\[0\]\.knots\[0\]: expected a list of numbers, got 4"),
    (
        "patches/0/knots/0/4",
        "1",
        r"patches\[0\]\.knots\[0\]\[4\]: expected a finite number, got '1'",
    ),
    (
        "patches/0/knots/0/4",
        -1,
        r"patches\[0\]: Patch, direction 1: BSpline\.knots\[4\]: expected a knot of at least 1, got -1",
    ),
    ("patches/0/knots/0/1", 0.5, r"patches\[0\]: Patch"),
    ("patches/0/knots/1", [0, 0.5, 1, 2], r"patches\[0\]: Patch\.knots2: expected open knots"),
    (
        "patches/0/control/2/1/0",
        None,
        r"patches\[0\]\.control\[2\]\[1\]\[0\]: expected a finite number, got nothing",
    ),
    (
        "patches/0/control/2/1/0",
        10**400,
        r"patches\[0\]\.control\[2\]\[1\]\[0\]: expected a finite number, got inf",
    ),
    (
        "patches/0/control/2/1/0",
        False,
        r"patches\[0\]\.control\[2\]\[1\]\[0\]: expected a finite number, got False",
    ),
    (
        "patches/0/control/2/1",
        [1, 2],
        r"patches\[0\]\.control\[2\]\[1\]: expected shape \(3,\) as in row 0, got shape \(2,\)",
    ),
    (
        "patches/0/control/2",
        [[2, 0, 0]],
        r"patches\[0\]\.control\[2\]: expected shape \(2, 3\) as in row 0, got shape \(1, 3\)",
    ),
    (
        "patches/0/control/2",
        ...,
        r"patches\[0\]\.control: expected 3 rows of 2 points of 2 or 3 coordinates.*shape \(2, 2, 3\)",
    ),
    ("patches/0/control", [[[1, 2]]], r"patches\[0\]\.control: expected 3 rows of 2 points"),
    ("patches/0/control", 1, r"patches\[0\]\.control: expected a list of lists, got 1"),
    (
        "patches/0/weights/1/0",
        0,
        r"patches\[0\]: Patch\.weights\[1, 0\]: expected a positive number, got 0",
    ),
    (
        "patches/0/weights/1",
        ...,
        r"patches\[0\]: Patch\.weights: expected shape \(3, 2\), one for each function, got \(2, 2\)",
    ),
    ("join", 1, r"join: expected true or false, got 1"),
    ("points", [], r"points: expected an object of names, got a list of 0"),
    ("points/tip/xi", [0.5], r"points\.tip\.xi: expected two knot parameters, got 1"),
    ("points/tip/xi", [0.5, 1.5], r"nurbs\.place, xi2: expected parameters in \[0, 1\], got 1\.5"),
    ("points/tip/patch", "roof", r"points\.tip\.patch: expected a patch of \[''\], got 'roof'"),
    ("points/tip/patch", ["a"], r"points\.tip\.patch: expected a patch"),
    ("edges/rims", [], r"edges\.rims: expected a list of names of edges, got a list of 0"),
    (
        "edges/rims",
        ["xi3_min"],
        r"edges\.rims: expected edges of .*, got 'xi3_min'; did you mean 'xi2_min'",
    ),
    ("edges/a b", ["xi2_min"], r"edges: expected a name of letters"),
]


@pytest.mark.parametrize("path,value,message", BAD)
def test_bad_entries(tmp_path: Path, path: str, value: Any, message: str) -> None:
    with pytest.raises(InputError, match=rf"a\.json: {message}") as caught:
        nurbs_file.read(saved(tmp_path, changed(path, value)))
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize(
    "text,message",
    [
        ("", r"a\.json:1:1: expected JSON, got Expecting value"),
        (
            '{"format": "fmbs-nurbs",\n "version" 1}',
            r"a\.json:2:12: expected JSON, got Expecting ':' delimiter",
        ),
        ('{"format": NaN}', r"a\.json: expected finite numbers, got NaN"),
        ('{"format": -Infinity}', r"a\.json: expected finite numbers, got -Infinity"),
        ('{"format": 1, "format": 2}', r"a\.json: expected every key once, got 'format' twice"),
        ("[" * 100_000, r"a\.json: expected JSON text in UTF-8, got maximum recursion depth"),
        (
            "[1]",
            r"a\.json: expected an object with the keys format, version, patches, got a list of 1",
        ),
    ],
)
def test_bad_json(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        nurbs_file.read(saved(tmp_path, text))


def test_two_patches_of_one_name(tmp_path: Path) -> None:
    item = {**QUARTER["patches"][0], "name": "roof"}
    with pytest.raises(
        InputError, match=r"patches\[1\]\.name: expected a name of its own, got 'roof' again"
    ):
        nurbs_file.read(saved(tmp_path, {**QUARTER, "patches": [item, item]}))


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="expected JSON text in UTF-8"):
        nurbs_file.read(tmp_path / "a.json")


def test_huge_files_and_refinements(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = saved(tmp_path, QUARTER)
    with pytest.raises(
        InputError,
        match=r"control points after refinement: expected at most 1000000, got up to 100030002",
    ):
        nurbs_file.read(file, cells=10_000)
    monkeypatch.setattr(nurbs_file, "MAX_BYTES", 100)
    with pytest.raises(InputError, match=r"a\.json: expected at most 100 bytes, got \d+"):
        nurbs_file.read(file)


@pytest.mark.parametrize(
    "options,message",
    [
        ({"cells": 0}, "cells: expected a whole number of at least 1, got 0"),
        ({"cells": 2.0}, r"cells: expected a whole number of at least 1, got 2\.0"),
        ({"degree": 11}, "degree: expected a whole number from 1 to 10, got 11"),
        ({"degree": 1}, r"elevate\.times: .*the degree cannot be lowered"),
        ({"scale": -1.0}, r"scale: expected a positive length \[m\], got -1\.0"),
    ],
)
def test_bad_options(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        nurbs_file.read(saved(tmp_path, QUARTER), **options)


def test_files_that_are_not_there_or_of_another_kind(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.json: expected a readable file, got No such file"):
        nurbs_file.read(tmp_path / "none.json")
    with pytest.raises(
        InputError, match=r"a\.step: expected a file \.json, \.igs, \.iges, \.3dm, got '\.step'"
    ):
        nurbs_file.read(saved(tmp_path, "", "a.step"))


# ---------------------------------------------------------------------------------------------------------------- CAD files
@pytest.mark.skipif(importlib.util.find_spec("rhino3dm") is not None, reason="rhino3dm is there")
def test_a_missing_package_is_named(tmp_path: Path) -> None:
    with pytest.raises(
        MissingFeature,
        match=r"expected the package rhino3dm to read .*install the extra fmbs_skfem\[cad\]",
    ):
        nurbs_file.read(saved(tmp_path, "x", "a.3dm"))


def iges(entities: list[tuple[int, int, int, str]], unit: str = "6,1HM", scale: str = "1.") -> str:
    """A file of (kind, form, directory line of the transformation, parameters); entity i has the
    directory line 2 i + 1.
    """
    lines = ["a test".ljust(72) + "S      1"]
    head = f"1H,,1H;,1Ha,5Ha.igs,1Hb,1Hc,32,38,6,308,15,1Ha,{scale},{unit},1,0.01,15H20260101.000000,1E-06,0.,,,11,0;"
    lines += [head[k : k + 72].ljust(72) + f"G{k // 72 + 1:7d}" for k in range(0, len(head), 72)]
    directory, parameters = [], []
    for i, (kind, form, matrix, text) in enumerate(entities):
        rows = textwrap.wrap(f"{kind},{text};", 64, break_long_words=False, break_on_hyphens=False)
        start = len(parameters) + 1
        parameters += [
            row.ljust(64) + f"{2 * i + 1:8d}P{start + k:7d}" for k, row in enumerate(rows)
        ]
        first = "".join(f"{v:8d}" for v in (kind, start, 0, 0, 0, 0, matrix, 0)) + "00000000"
        directory.append(first + f"D{2 * i + 1:7d}")
        directory.append(
            "".join(f"{v:8d}" for v in (kind, 0, 0, len(rows), form))
            + " " * 32
            + f"D{2 * i + 2:7d}"
        )
    return "\n".join([*lines, *directory, *parameters, "S      1".ljust(72) + "T      1"]) + "\n"


def spline(item: dict[str, Any], ranges: str = "0., 1., 0., 1.") -> str:
    """The parameters of an entity 128, with blanks where lines may break."""
    points, weights = (
        np.array(item[key], dtype=float).swapaxes(0, 1) for key in ("control", "weights")
    )
    k2, k1 = weights.shape
    numbers = [
        *item["knots"][0],
        *item["knots"][1],
        *weights.ravel().tolist(),
        *points.ravel().tolist(),
    ]
    head = [k1 - 1, k2 - 1, *item["degree"], 0, 0, 0, 0, 0]
    return ", ".join(
        [*map(str, head), *(repr(float(number)).replace("e", "D") for number in numbers), ranges]
    )


PATCH = spline(QUARTER["patches"][0])
#: a boundary once around the parameters: a composite of two lines, and one spline of three points
#: over two sides
AROUND = [
    (110, 0, 0, "0., 0., 0., 1., 0., 0."),
    (110, 0, 0, "1., 0., 0., 1., 1., 0."),
    (
        126,
        0,
        0,
        "2, 1, 1, 0, 1, 0, 0., 0., 1., 2., 2., 1., 1., 1., 1., 1., 0., 0., 1., 0., 0., 0., 0., 0., 2., 0., 0., 1.",
    ),
]


def test_iges(tmp_path: Path) -> None:
    """The same surface as in JSON; curves are passed over, and exponents may be D."""
    wanted = nurbs_file.read(saved(tmp_path, QUARTER)).reference
    for name in ("a.igs", "a.IGES"):
        found = nurbs_file.read(saved(tmp_path, iges([AROUND[0], (128, 0, 0, PATCH)]), name))
        assert_allclose(found.reference, wanted, atol=1e-14)
    with pytest.raises(InputError, match="expected 1 to 1000 NURBS surfaces, got 0"):
        nurbs_file.read(saved(tmp_path, iges(AROUND), "a.igs"))
    for text in ("no IGES\n" * 9, "", iges([(128, 0, 0, "1, 1, 1")])):
        with pytest.raises(InputError, match=r"b\.igs: .*expected"):
            nurbs_file.read(saved(tmp_path, text, "b.igs"))


@pytest.mark.parametrize(
    "unit,length",
    [("2,2HMM", 1e-3), ("1,2HIN", 0.0254), ("3,2HCM", 0.01), ("4,2HFT", 0.3048), (",", None)],
)
def test_the_unit_of_an_iges_file(unit: str, length: float | None, tmp_path: Path) -> None:
    file = saved(tmp_path, iges([(128, 0, 0, PATCH)], unit), "a.igs")
    wanted = nurbs_file.read(saved(tmp_path, QUARTER)).reference
    assert_allclose(nurbs_file.read(file).reference, (length or 1.0) * wanted, atol=1e-14)
    assert_allclose(
        nurbs_file.read(file, scale=length or 0.5).reference, (length or 0.5) * wanted, atol=1e-14
    )
    if length:
        with pytest.raises(
            InputError, match=rf"a\.igs: unit: expected {length:g} m as the file says, got 0\.5 m"
        ):
            nurbs_file.read(file, scale=0.5)


def test_transformations_of_iges(tmp_path: Path) -> None:
    """x -> A x + a, a quarter turn about z and a shift, then x -> x + b of the transformation of
    the transformation.
    """
    turned = (124, 0, 3, "0., -1., 0., 5., 1., 0., 0., 6., 0., 0., 1., 7.")
    moved = (124, 0, 0, "1., 0., 0., 10., 0., 1., 0., 20., 0., 0., 1., 30.")
    item = copy.deepcopy(QUARTER)
    for row in item["patches"][0]["control"]:
        row[:] = [[-y + 15.0, x + 26.0, z + 37.0] for x, y, z in row]
    found = nurbs_file.read(saved(tmp_path, iges([turned, moved, (128, 0, 1, PATCH)]), "a.igs"))
    assert_allclose(found.reference, nurbs_file.read(saved(tmp_path, item)).reference, atol=1e-14)
    circle = [(124, 0, 1, turned[3]), (128, 0, 1, PATCH)]
    with pytest.raises(InputError, match="at most 20 transformations"):
        nurbs_file.read(saved(tmp_path, iges(circle), "a.igs"))


def test_a_trimmed_surface_of_iges_is_whole_or_refused(tmp_path: Path) -> None:
    """Surface at line 7, composite boundary 9, curve on the surface 11, trimmed surface 13."""
    parts = [*AROUND, (128, 0, 0, PATCH), (102, 0, 0, "3, 1, 3, 5"), (142, 0, 0, "0, 7, 9, 0, 1")]
    wanted = nurbs_file.read(saved(tmp_path, QUARTER)).reference
    for trim in ("7, 0, 0, 0", "7, 1, 0, 11"):
        found = nurbs_file.read(saved(tmp_path, iges([*parts, (144, 0, 0, trim)]), "a.igs"))
        assert_allclose(found.reference, wanted, atol=1e-14)
    hole = [*parts, (144, 0, 0, "7, 0, 1, 0, 11")]
    with pytest.raises(
        InputError,
        match="directory line 13: expected untrimmed surfaces, got entity 144, a trimmed one with 1 holes",
    ):
        nurbs_file.read(saved(tmp_path, iges(hole), "a.igs"))
    half = [(110, 0, 0, "0., 0., 0., 0.5, 0., 0."), (110, 0, 0, "0.5, 0., 0., 0.5, 1., 0.")]
    slant = [AROUND[0], (110, 0, 0, "1., 0., 0., 0.9, 1., 0.")]
    for lines in (half, slant):
        other = [*lines, *parts[2:]]
        with pytest.raises(InputError, match="expected untrimmed surfaces, got entity 144"):
            nurbs_file.read(saved(tmp_path, iges([*other, (144, 0, 0, "7, 1, 0, 11")]), "a.igs"))


@pytest.mark.parametrize(
    "entity,said",
    [
        (
            (120, 0, 0, "1, 1, 0., 1."),
            "directory line 3: expected rational B-spline surfaces .*, got entity 120, a surface of revolution",
        ),
        ((186, 0, 0, "1, 1, 0"), "directory line 3: .*got entity 186, a solid by its boundary"),
        (
            (408, 0, 0, "1, 0., 0., 0., 1."),
            "directory line 3: .*got entity 408, a copy of a subfigure",
        ),
        (
            (143, 0, 0, "1, 1, 1, 1"),
            "directory line 3: expected untrimmed surfaces, got entity 143, a bounded one",
        ),
        (
            (144, 0, 0, "9, 0, 0, 0"),
            "directory line 3: expected the directory line of an entity, got 9",
        ),
        ((128, 0, 1, PATCH), "directory line 1: expected a transformation .*, got entity 128"),
        (
            (128, 0, 0, spline(QUARTER["patches"][0], "0., 0.5, 0., 1.")),
            "directory line 3: expected a whole surface, got entity 128 of",
        ),
    ],
)
def test_what_iges_cannot_give_is_refused(
    entity: tuple[int, int, int, str], said: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=said):
        nurbs_file.read(saved(tmp_path, iges([(128, 0, 0, PATCH), entity]), "a.igs"))


def test_a_scale_of_an_iges_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"global section: expected a model scale of 1, got 0\.5"):
        nurbs_file.read(saved(tmp_path, iges([(128, 0, 0, PATCH)], scale="0.5"), "a.igs"))


def test_3dm_through_rhino3dm(tmp_path: Path) -> None:
    rhino3dm = pytest.importorskip("rhino3dm")
    cylinder = rhino3dm.Cylinder(rhino3dm.Circle(rhino3dm.Point3d(0.0, 0.0, 0.0), 2.0), 3.0)
    for kind in ("surface", "brep"):
        model, file = rhino3dm.File3dm(), tmp_path / f"{kind}.3dm"
        model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Centimeters
        if kind == "surface":
            model.Objects.AddSurface(rhino3dm.NurbsSurface.CreateFromCylinder(cylinder))
        else:
            model.Objects.AddBrep(cylinder.ToBrep(False, False))
        model.Write(str(file), 7)
        shape = nurbs_file.read(file, degree=3)
        assert len(shape.nodes) == 4
        assert_allclose(radii(shape, (0, 1)), 0.02, rtol=1e-14)
    model.Objects.AddMesh(rhino3dm.Mesh())
    model.Write(str(file), 7)
    with pytest.raises(
        InputError, match=r"brep\.3dm: object 2: expected a NURBS surface, got a Mesh"
    ):
        nurbs_file.read(file)
    with pytest.raises(InputError, match=r"b\.3dm: expected a 3dm file"):
        nurbs_file.read(saved(tmp_path, "no model", "b.3dm"))


def test_a_file_that_stays_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once for each refinement, with arrays of their own for all who ask, and anew where the file
    has changed.
    """
    made: list[int] = []
    whole = nurbs_file._surface

    def counted(path: Path, content: Any, cells: int, *more: Any) -> Surface:
        made.append(cells)
        return whole(path, content, cells, *more)

    monkeypatch.setattr(nurbs_file, "_surface", counted)
    monkeypatch.setattr(remembered_files, "SETTLED", -1.0)
    monkeypatch.setattr(remembered_files, "KNOWN", OrderedDict())
    path = saved(tmp_path, QUARTER)
    one, other = (nurbs_file.read(path, cells=2) for _ in range(2))
    same(one, other)
    one.reference[:] = 0.0
    same(nurbs_file.read(path, cells=2), other)
    assert made == [2]
    assert len(nurbs_file.read(path, cells=3).reference) > len(other.reference)
    path.write_text(json.dumps(QUARTER).replace("[0, 3, 2]", "[0, 3.0, 2]"))
    nurbs_file.read(path, cells=2)
    assert made == [2, 3, 2]
