"""Go on with a run that was stopped or killed, bit for bit as if it had not been."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...core.errors import CorruptFile, InputError, say
from ...core.notices import notify
from ...core.storage import locks
from ...dynamics.checkpoint import differences
from ...results import segments
from .. import job as jobs
from .. import reports
from ..job import Job
from ..planning.planned import Planned
from . import compiling, runs, solving
from .outcome import Run


def resume_run(job: Job) -> Run:
    """The run in the folder of a job, from its last checkpoint to the end."""
    out = job.path
    if job.out is not None:
        raise InputError(say("--out", "no folder beside DIR", f"{job.out}", "results go into DIR"))
    segments.manifest(out)
    with locks.own(out):
        found = segments.manifest(out)
        asked = found.job
        same = {
            name: asked[name]
            for name in ("changes", "allow_outside", "repair", "duration", "checkpoint")
        }
        own = replace(job, path=Path(asked["scene"]), out=out, made=out, **same)
        own.listener.begin(own)
        # found once, before the run was stopped
        own.plan = Planned(**asked["plan"]) if asked.get("plan") else None
        scene = jobs.read_scene(own, plans=False)
        task = runs.scene_task(own, own.plan.scene(scene) if own.plan else scene)
        compare(out, asked["provenance"], reports.plain(task.facts["provenance"]))
        solving.warm_up(task, compiling.announce(own))
        record = segments.Recorder(out, asked, asked["checkpoint"], found)
        return solving.finish(own, task, None, record, segments.read(out))


def compare(out: Path, then: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    """Refuse another scene, other meshes or another release; warn of other libraries or another
    machine.
    """

    binding = [
        differences(binds(then), binds(now)),
        differences(flatten(then["scene"], "scene"), flatten(now["scene"], "scene")),
    ]
    other = [text for texts in binding for text in texts]
    if other:
        remedy = "restore what has changed, or run the scene anew with --force"
        raise CorruptFile(
            say(
                f"{out}",
                "the scene, the meshes and the release of its run",
                "; ".join(other),
                remedy,
            )
        )
    loose = differences(flatten(loosely(then)), flatten(loosely(now)))
    if loose:
        notify(
            f"{out}: {'; '.join(loose)}; the numbers may differ in their last digits from those of an unbroken run"
        )


def binds(found: Mapping[str, Any]) -> dict[str, str]:
    """Release and files, but for the text of the scene, whose values are compared."""
    release = {"release of fmbs_skfem": str(found["versions"]["fmbs_skfem"])}
    return release | {
        f"sha256 of {name}": text for name, text in found["files"].items() if name != found["file"]
    }


def loosely(found: Mapping[str, Any]) -> dict[str, Any]:
    """Libraries, machine and threads."""
    versions = {name: text for name, text in found["versions"].items() if name != "fmbs_skfem"}
    return {"versions": versions, "machine": found["machine"], "threads": found["threads"]}


def flatten(value: Any, name: str = "") -> dict[str, str]:
    """Values of a tree as texts, by their path of keys."""
    if isinstance(value, Mapping):
        pairs = [(f"{name}.{key}" if name else str(key), item) for key, item in value.items()]
    elif isinstance(value, list):
        pairs = [(f"{name}[{number}]", item) for number, item in enumerate(value)]
    else:
        return {name: repr(value)}
    return {path: text for key, item in pairs for path, text in flatten(item, key).items()}
