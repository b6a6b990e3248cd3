"""The motion of a training in an FMU, and what the model errs by, as related files of FMI-LS-REF
(github.com/modelica/fmi-ls-ref, 1.0.0-alpha.1; the experiment as in github.com/modelica/ma-hs-experiments).

A tool that has loaded the FMU runs it over the times of `training.exp` and compares it with
`training.csv`: that is the model in Python, which it repeats to its tolerance. `errors.csv` has what the model itself errs
by, against the full one in its training.
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple
from xml.etree import ElementTree as xml

import numpy as np

NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
#: of files: what they are for the standard, their types, and what people read
RELATED = {
    "training.exp": (
        "experiment/smoke-test",
        "application/x-ma-hs-experiments",
        "The motion of the training",
    ),
    "training.csv": ("result", "text/csv", "Outputs of this motion, of the model in Python"),
    "errors.csv": (
        "report",
        "text/csv",
        "Largest errors of outputs in the training, against the full model",
    ),
}


class TrainingMotion(NamedTuple):
    """A motion with the start values of parameters and inputs, and errors of the training."""

    step: float  #: of the model [s]
    times: np.ndarray  #: (s,) [s]
    columns: Mapping[str, np.ndarray]  #: (s,) outputs by name
    #: of outputs by name: unit, largest error in it, and the same over the range; none where they are not known
    errors: Mapping[str, tuple[str, float | None, float | None]]


def texts_of(
    reference: TrainingMotion, title: str, names: Mapping[str, str]
) -> dict[str, xml.Element | str]:
    """The files by their names in the archive; `names` are those of outputs in the FMU."""
    known = {names[name]: one for name, one in reference.columns.items() if np.isfinite(one).all()}
    rows = zip(reference.times, *known.values(), strict=True)
    found: dict[str, xml.Element | str] = {
        "training.exp": experiment(reference, title),
        "training.csv": table(["time", *known], ([f"{x:.12g}" for x in row] for row in rows)),
    }
    if reference.errors:
        head = ["output", "unit", "error", "error over range"]
        found["errors.csv"] = table(
            head,
            (
                [names[name], unit, *("" if one is None else f"{one:.4g}" for one in both)]
                for name, (unit, *both) in reference.errors.items()
            ),
        )
    return {f"{FOLDER}/{name}": one for name, one in found.items()}


def experiment(reference: TrainingMotion, title: str) -> xml.Element:
    """The experiment: a motion over its times, in steps of the model."""
    root = xml.Element("Experiments", name=title)
    about = {"name": "training", "description": RELATED["training.exp"][2]}
    one = xml.SubElement(root, "Experiment", about)
    times = {"startTime": "0.0", "stopTime": repr(float(reference.times[-1]))}
    xml.SubElement(one, "TransientSimulation", times | {"stepSize": repr(reference.step)})
    xml.SubElement(one, "References", source="training.csv")
    return root


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Rows as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue()


def manifest(files: Mapping[str, str]) -> xml.Element:
    """The manifest of these files, with their checksums."""
    name = "Layered Standard providing information on related files included in an FMU."
    own = {"name": "org.fmi-standard.fmi-ls-ref", "version": "1.0.0-alpha.1", "description": name}
    xml.register_namespace("fmi-ls", NAMESPACE)
    root = xml.Element(
        "fmiReferences", {f"{{{NAMESPACE}}}fmi-ls-{key}": value for key, value in own.items()}
    )
    for place, text in files.items():
        source = place.removeprefix(f"{FOLDER}/")
        role, kind, about = RELATED[source]
        sums = {"checksum": hashlib.sha3_256(text.encode()).hexdigest(), "checksumType": "SHA3-256"}
        what = {"type": kind, "source": source, "role": role, "description": about}
        xml.SubElement(root, "Related", what | sums)
    return root
