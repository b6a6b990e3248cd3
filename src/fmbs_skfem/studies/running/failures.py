"""What is kept and shown of a solve that failed: failure.json, the last good state with a picture of it, and two short tables.

failure.h5 is HDF5: x, v, a (n,) with the names `unknowns` (n,), multipliers (m,) with the names `constraints` (m,), attribute time.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.errors import SolverError
from ...core.notices import notify
from .. import reports
from ..job import Job
from ..result import ReportTable

if TYPE_CHECKING:
    from ...dynamics import Trajectory
    from ...dynamics.diagnoses.diagnosis import Diagnosis

FAILURE, STATE, PICTURE = "failure.json", "failure.h5", "failure.png"
NAMES = (FAILURE, STATE, PICTURE)
SHORT = 3  #: entries of a list that a table shows


def write_failure(out: Path | None, found: Mapping[str, Any], error: SolverError | None, picture: bool = True) -> dict[str, Any]:
    """The report of a run with its `failure`, which is also written into the folder; files of an earlier failure are removed.

    Beside it stands the last good state. Without a folder nothing is explained.
    """
    if out is None:
        return dict(found)
    own = clear_earlier(out)
    if error is None:
        return dict(found)
    from . import pictures

    facts = explain(error)
    files = [reports.write_json(out / FAILURE, {**facts, "provenance": found["provenance"]})] if own else []
    if own and error.partial is not None:
        files += [
            write_state(out / STATE, error.partial),
            *(pictures.last(error.partial, out / PICTURE, facts["unit"]) if picture else ()),
        ]
    return {**found, "failure": facts, "files": [*found.get("files", ()), *files]}


def clear_earlier(out: Path) -> bool:
    """Remove the files of an earlier failure; False with a warning where the names are taken by files of other origin."""
    taken = [name for name in NAMES if (out / name).exists()]
    if not taken:
        return True
    with contextlib.suppress(OSError, ValueError):
        if "causes" in json.loads((out / FAILURE).read_text(encoding="utf-8")):
            for name in taken:
                (out / name).unlink()
            return True
    notify(f"{out}: {', '.join(taken)} did not come from here and are kept")
    return False


def write_state(path: Path, trajectory: Trajectory) -> Path:
    """The last state of a trajectory, with the names of its unknowns and constraints."""
    from ...core.storage import container, durable
    from ...dynamics import names

    trajectory = trajectory.states
    system = trajectory.system
    state = {name: getattr(trajectory, name)[-1] for name in ("x", "v", "a", "multipliers")}
    named = {"unknowns": names.coordinate_names(system), "constraints": names.row_names(system)[system.size :]}
    return durable.write(path, container.image({**state, **named, "time": trajectory.times[-1]}))


def write_failed_start(job: Job, error: SolverError, provenance: Mapping[str, Any]) -> None:
    """What is known of a solve that never started, into its folder and to the listener."""
    found = write_failure(job.made, {"provenance": provenance}, error)
    for cause in found.get("failure", {}).get("causes", ()):
        job.listener.tell(f"likely cause: {cause['what']}; {cause['remedy']}")
    for path in found.get("files", ()):
        job.listener.tell(f"written: {path}")


def explain(error: SolverError) -> dict[str, Any]:
    """The diagnosis as a JSON object."""
    from ...dynamics.diagnoses import diagnosis

    return plain(diagnosis.explain(error))


def plain(found: Diagnosis) -> dict[str, Any]:
    """A diagnosis whose reasons are texts and whose pairs are objects."""
    facts = asdict(found)
    for name in ("residuals", "by_body", "multipliers", "null"):
        facts[name] = [{"name": label, "value": value} for label, value in facts[name]]
    for attempt in facts["attempts"]:
        attempt["outcome"] = attempt["outcome"].value if attempt["outcome"] else "taken"
    return {**facts, "reason": found.reason.value}


def views(found: Mapping[str, Any]) -> list[ReportTable]:
    """The failure in a report as tables: its facts, and causes with what to try."""
    if "failure" not in found:
        return []
    facts = found["failure"]
    causes = [(cause["name"], cause["what"], cause["remedy"]) for cause in facts["causes"]]
    return [ReportTable("Failure", ("", "value"), rows(facts)), ReportTable("Likely causes", ("cause", "what", "try"), causes)]


def rows(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The facts of a failure that fit into a table."""
    found = [("reason", facts["reason"]), (f"not reached [{facts['unit']}]", f"{facts['at']:.9g}")]
    if facts["good"] is not None:
        found.append((f"last good state [{facts['unit']}]", f"{facts['good']:.9g}"))
    if facts["step"] is not None:
        found.append(("step", str(facts["step"])))
    for name, label in (("residuals", "worst residuals"), ("multipliers", "largest reactions"), ("null", "weakest direction")):
        if facts[name]:
            found.append((label, ", ".join(f"{one['name']}: {one['value']:.3g}" for one in facts[name][:SHORT])))
    for attempt in facts["attempts"][:1] + facts["attempts"][-1:]:
        course = " ".join(f"{value:.1e}" for value in attempt["residuals"][:5])
        found.append((f"residuals with step {attempt['step']:.3g} s", f"{course} ({attempt['outcome']})"))
    return found
