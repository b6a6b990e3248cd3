"""Files of earlier releases, one of every kind, are read as on the day on which they were written.

    python -m tests.test_kept_files    writes expected.json beside the files of a new release

The files lie in `tests/kept`, a folder a release, with the commands that made them.
"""

from __future__ import annotations

import importlib
import json
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes, studies, systems
from fmbs_skfem.core.storage import container
from fmbs_skfem.core.storage.container import FileKind
from fmbs_skfem.dynamics.checkpoint import Checkpoint, differences
from fmbs_skfem.families import parametric_model, prediction, training_store
from fmbs_skfem.reduction import files
from fmbs_skfem.results import segments, sweep_files
from fmbs_skfem.scenes import build

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "tests" / "kept" / "0.2.0"
EXPECTED = KEPT / "expected.json"
NEAR = 1e-6  #: of the range of an output
SHOWN = 5  #: instants of a history in the expected values
DIGITS = 10
LARGEST, ALL = 60_000, 250_000  #: of a file, and of all [bytes]

Columns = dict[str, np.ndarray]


def whole(outputs: Columns) -> Columns:
    """Columns of a motion as arrays."""
    return {name: np.asarray(values, float) for name, values in outputs.items()}


def model(folder: Path) -> Columns:
    """A reduced model, run."""
    return whole(dynamics.outputs(files.run(files.read(KEPT / "swing.h5"))))


def family(folder: Path) -> Columns:
    """A model over a range, run at a value inside of it, with the error that it predicts there."""
    rom = parametric_model.load(KEPT / "family" / "model.h5")
    found = whole(dynamics.outputs(parametric_model.run(rom, E=0.9e6)))
    predict = prediction.predictor(rom)
    assert predict is not None
    error = predict({"E": 0.9e6})
    return found | {"predicted": np.array([error.low, error.error, error.high])}


def part(folder: Path) -> Columns:
    """A part that stands twice in a scene, and is held against a finer one."""
    run = scenes.read(KEPT / "pair.yaml").run()
    return whole(run.outputs)


def history(folder: Path) -> Columns:
    """A run that was stopped, gone on with to its end.

    Its checkpoint is of the same model and method as one that is taken here; arrays of the model
    differ in last bits from processor to processor, where `fmbs resume` refuses to go on.
    """
    arm = systems.eliminate(build.system(scenes.read(KEPT / "arm.yaml")))
    scheme = dynamics.GeneralizedAlpha(step=5e-3)
    here: list[Checkpoint] = []
    dynamics.integrate(arm, scheme, 0.2, record=lambda moment: here.append(moment.checkpoint()))
    left = segments.read(KEPT / "run")
    assert left.checkpoint.done == 8
    others = differences(left.checkpoint.facts, here[0].facts)
    assert [text for text in others if not text.startswith("arrays of the model")] == []
    left = replace(left, checkpoint=replace(left.checkpoint, facts=here[0].facts))
    motion = dynamics.integrate(arm, scheme, 0.2, resume=left)
    np.testing.assert_array_equal(motion.x[: left.checkpoint.kept], left.rows.x)
    return whole(dynamics.outputs(motion))


def training(folder: Path) -> Columns:
    """A training that goes on, whose full runs, checks and models are all there."""
    place = folder / "family" / "training"
    shutil.copytree(KEPT / "family" / "training", place)
    before = contents(place)
    found = studies.train(KEPT / "sheet.yaml", out=folder / "family", resume=True, plots=False)
    assert contents(place) == before
    assert found.model is not None
    return whole(dynamics.outputs(parametric_model.run(found.model, E=0.9e6)))


def sweep(folder: Path) -> Columns:
    """A sweep that goes on with the one member that is missing."""
    shutil.copytree(KEPT / "sweep", folder / "sweep")
    sweep_files.store_of(folder / "sweep").path("", 1).unlink()
    there = contents(folder / "sweep" / "members")
    with ThreadPoolExecutor(1) as executor:
        found = studies.sweep(
            KEPT / "arm.yaml",
            samples=3,
            design="grid",
            instants=5,
            scheduler=executor,
            resume=True,
            plots=False,
            out=folder / "sweep",
        )
    assert found.report["computed"] == 1
    assert there.items() < contents(folder / "sweep" / "members").items()
    again = sweep_files.read(folder / "sweep", 1).result
    kept = sweep_files.read(KEPT / "sweep", 1).result
    assert again is not None
    assert kept is not None
    for name, values in kept.columns.items():
        np.testing.assert_allclose(again.columns[name], values, atol=NEAR * np.ptp(values))
    return {
        f"{name} {number}": row
        for name, rows in found.outputs.items()
        for number, row in enumerate(rows)
    }


READERS: dict[str, Callable[[Path], Columns]] = {
    "model": model,
    "family": family,
    "part": part,
    "history": history,
    "training": training,
    "sweep": sweep,
}


def contents(folder: Path) -> dict[str, bytes]:
    """The files of a folder by name."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def chosen(values: np.ndarray) -> np.ndarray:
    """Few values of a history, the first and the last one among them."""
    return values[np.linspace(0, len(values) - 1, min(SHOWN, len(values))).astype(int)]


def kinds() -> Iterator[FileKind]:
    """All kinds of files that the package declares, each a `KIND` of its module."""
    source = ROOT / "src"
    for path in sorted(source.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        declared = re.findall(r"^KIND\b.* = ", text, re.MULTILINE)
        made = re.findall(r"^\w+(?:: \w+)? = FileKind\(", text, re.MULTILINE)
        assert len(made) <= len(declared) <= 1, path
        if declared:
            name = ".".join(path.relative_to(source).with_suffix("").parts)
            yield importlib.import_module(name).KIND


@pytest.mark.filterwarnings("ignore::fmbs_skfem.core.notices.Notice")  # what the kept files err by
@pytest.mark.parametrize("name", READERS)
def test_a_kept_file_gives_the_numbers_of_its_release(name: str, tmp_path: Path) -> None:
    expected = json.loads(EXPECTED.read_text(encoding="utf-8"))[name]
    found = READERS[name](tmp_path)
    assert list(found) == list(expected)
    for column, values in found.items():
        np.testing.assert_allclose(
            chosen(values), expected[column], rtol=0.0, atol=NEAR * np.ptp(values), err_msg=column
        )


def test_every_kind_of_file_is_kept() -> None:
    declared = {kind.title: kind.version for kind in kinds()}
    assert len(declared) >= 6
    kept = {container.title(path) for path in KEPT.rglob("*.h5")}
    assert kept == set(declared)
    assert training_store.KIND.title in kept


def test_kept_files_are_small_and_hold_no_folders_of_their_maker() -> None:
    sizes = {path: path.stat().st_size for path in KEPT.rglob("*") if path.is_file()}
    assert max(sizes.values()) < LARGEST
    assert sum(sizes.values()) < ALL
    for path in sizes:
        assert re.search(rb"/(tmp|home|work|Users|root)/", path.read_bytes()) is None, path


def test_the_page_says_how_each_of_them_was_made() -> None:
    page = (KEPT / "README.md").read_text(encoding="utf-8")
    made = [path for path in KEPT.iterdir() if path.suffix != ".md"]
    assert [path.name for path in made if path.name not in page] == []


def write() -> None:
    """The expected values, of files that were written just now."""
    found: dict[str, dict[str, list[float]]] = {}
    for name, read in READERS.items():
        with tempfile.TemporaryDirectory() as folder:
            columns = read(Path(folder))
        found[name] = {
            column: [float(f"{value:.{DIGITS}g}") for value in chosen(values)]
            for column, values in columns.items()
        }
    EXPECTED.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write()
