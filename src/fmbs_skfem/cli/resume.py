"""`fmbs resume`: go on with a run that was stopped or killed, bit for bit as if it had not been."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from ..core.errors import CorruptFile, InputError, say
from ..core.notices import notify
from . import common, reports
from .common import Result, Session


@common.command("resume", scene=False)
@click.argument("path", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--plots/--no-plots", default=True, help="Draw the outputs into outputs.png (default: yes).")
@common.TIME_LIMIT
def command(session: Session, plots: bool, limit: float) -> Result:
    """Go on with the run whose output folder is DIR, from its last checkpoint to the end.

    The numbers are those of a run that was never stopped. Every byte that is read is verified, and a scene or mesh that has changed
    since then is refused (exit code 8).
    """
    from ..results import segments
    from . import solving

    out = session.path
    if session.out is not None:
        raise InputError(say("--out", "no folder beside DIR", f"{session.out}", "results go into DIR"))
    segments.manifest(out)
    with segments.locked(out):
        found = segments.manifest(out)
        job = found.job
        same = {name: job[name] for name in ("changes", "allow_outside", "repair")}
        own = replace(session, path=Path(job["scene"]), out=out, **same)
        scene = common.read_scene(own, job["duration"])
        compare(out, job["provenance"], reports.plain(reports.provenance(scene)))
        record = segments.Recorder(out, job, job["checkpoint"], found)
        solved = solving.solve(own, scene, record, segments.read(out, found), limit)
        _, report = solving.keep(own, solved, plots=plots)
    return solving.result(solved, report, [])


def compare(out: Path, then: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    """Refuse another scene, other meshes or another release; tell of other libraries or another machine."""
    from ..dynamics.checkpoint import differences

    binding = [differences(binds(then), binds(now)), differences(flat(then["scene"], "scene"), flat(now["scene"], "scene"))]
    other = [text for texts in binding for text in texts]
    if other:
        remedy = "restore what has changed, or run the scene anew with --force"
        raise CorruptFile(say(f"{out}", "the scene, the meshes and the release of its run", "; ".join(other), remedy))
    loose = differences(flat(loosely(then)), flat(loosely(now)))
    if loose:
        notify(f"{out}: {'; '.join(loose)}; the numbers may differ in their last digits from those of an unbroken run")


def binds(found: Mapping[str, Any]) -> dict[str, str]:
    """Release and files, but for the text of the scene, whose values are compared."""
    release = {"release of fmbs_skfem": str(found["versions"]["fmbs_skfem"])}
    return release | {f"sha256 of {name}": text for name, text in found["files"].items() if name != found["file"]}


def loosely(found: Mapping[str, Any]) -> dict[str, Any]:
    """Libraries, machine and threads."""
    versions = {name: text for name, text in found["versions"].items() if name != "fmbs_skfem"}
    return {"versions": versions, "machine": found["machine"], "threads": found["threads"]}


def flat(value: Any, name: str = "") -> dict[str, str]:
    """Values of a tree as texts, by their path of keys."""
    if isinstance(value, Mapping):
        pairs = [(f"{name}.{key}" if name else str(key), item) for key, item in value.items()]
    elif isinstance(value, list):
        pairs = [(f"{name}[{number}]", item) for number, item in enumerate(value)]
    else:
        return {name: repr(value)}
    return {path: text for key, item in pairs for path, text in flat(item, key).items()}
