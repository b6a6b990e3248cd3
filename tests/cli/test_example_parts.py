"""The mechanisms of `examples/parts`: each stands of parts that were trained alone, runs, and moves
as with the full bodies.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Body
from fmbs_skfem.dynamics import GeneralizedAlpha, integrate, outputs
from fmbs_skfem.parts import departures
from fmbs_skfem.parts import files as part_files
from fmbs_skfem.results.motion import frames
from fmbs_skfem.scenes import Scene, build
from fmbs_skfem.scenes.bodies import PlacedPart

from .calls import EXAMPLES, fmbs

FOLDER = EXAMPLES / "parts"
MECHANISMS = sorted(path.stem for path in FOLDER.glob("*.yaml") if path.stem != "library")
DURATION = 0.3  #: of the comparison [s]


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.part.h5")), ids=lambda path: path.stem)
def test_parts_hold_no_folders_of_their_training(path: Path) -> None:
    """Neither of this machine nor of another one: their files are those beside them."""
    origin = part_files.load(path).notes["provenance"]
    assert origin["file"] == "library.yaml"
    assert all((FOLDER / name).is_file() and Path(name).name == name for name in origin["files"])
    assert not re.search(r'"(/|[A-Za-z]:)', json.dumps(part_files.load(path).notes))


def with_full_bodies(scene: Scene) -> list[Body]:
    """The bodies of a mechanism, parts replaced by what they were made of."""
    library = scenes.read(FOLDER / "library.yaml")
    found = []
    for name, model in scene.bodies.items():
        if isinstance(model, PlacedPart):
            own = library.bodies[model.file.removesuffix(".part.h5")]
            moved = replace(own, name=name, origin=model.origin, rotation=model.rotation)  # type: ignore[call-arg]
            found.append(moved.build(library, None, False))
        else:
            found.append(model.build(scene, None, False))
    return found


def test_there_are_five() -> None:
    assert MECHANISMS == ["four_bar", "mobile", "pendulum", "rotor", "swing"]


@pytest.mark.parametrize("name", ["arm", "link", "blade"])
def test_the_parts_can_be_made_coarser_and_know_what_they_lack(name: str) -> None:
    part = part_files.resume(FOLDER / f"{name}.part.h5")
    small = part_files.coarsen(part, None, part.notes["functions"] // 2)
    assert small.notes["functions"] < part.notes["functions"]
    fine, coarse = (one.body.shapes.missing for one in (part, small))  # type: ignore[union-attr]
    assert fine is not None
    assert coarse is not None
    assert 0.0 < 2.0 * fine.left_out < coarse.left_out


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_mechanism_of_parts_moves_as_that_of_full_bodies(name: str) -> None:
    """Largest distance of any output from the full model, of some metres: 1e-3 m; no strain leaves
    the training.

    Pictures and VTK series have the same fields of both at the same points, which are as near to
    each other.
    """
    scene = scenes.read(FOLDER / f"{name}.yaml")
    scheme = GeneralizedAlpha(1e-3, 0.8)
    systems = [
        build.of_parts(scene, made) for made in (with_full_bodies(scene), build.parts(scene))
    ]
    full, reduced = (integrate(build.chosen_form(scene, one), scheme, DURATION) for one in systems)
    assert reduced.system.size < 0.5 * full.system.size
    wanted, found = outputs(full), outputs(reduced)
    ranges = [float(np.ptp(column)) for column in wanted.values()]
    assert max(ranges) > 0.05
    assert max(float(np.abs(found[key] - column).max()) for key, column in wanted.items()) < 1e-3
    assert departures.find(reduced) == []
    shown, own = (frames(one, np.arange(0, len(one.times), 50)) for one in (full, reduced))
    assert list(shown.bodies) == list(own.bodies)
    assert shown.marks.keys() == own.marks.keys()
    for body, one in shown.bodies.items():
        other = own.bodies[body]
        assert np.abs(other.points - one.points).max() < 1e-3
        # the files are of a release that knew no fibres
        assert one.fields.keys() - other.fields.keys() <= {"von_mises"}


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_scene_of_parts_runs(name: str, tmp_path: Path) -> None:
    path = FOLDER / f"{name}.yaml"
    found = fmbs(
        "run", path, "--duration", "0.3", "--no-plots", "--json", "--out", tmp_path / "out"
    )
    assert found.code == 0, found.err
    assert found.json["notices"] == []
