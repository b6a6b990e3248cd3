"""`fmbs sweep`: many members of a scene or of a saved reduced model, on all cores or on a cluster."""

from __future__ import annotations

import signal
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import InputError, SweepFailure, say
from . import common, reports, screen, sources
from .common import Result, Session
from .run import SAVED
from .sources import Limits, Source

if TYPE_CHECKING:
    import numpy as np

    from ..reduction.members import Record
    from ..reduction.sweeps import Options, Outcome
    from ..results.sweep_files import Sweep

DESIGNS = ("sobol", "lhs", "grid", "list")
PLOTS = ("response.png", "scatter.png", "histories.png")
SURROGATE = "surrogate.png"  #: of a model that has a record of its training
LISTED = 20  #: failed members in the table on the screen


@common.command("sweep")
@click.option("--samples", metavar="N", help="Number of members; of a grid also N1xN2x...: values of each parameter.")
@click.option("--design", type=click.Choice(DESIGNS), help="How they are spread (default: sobol).")
@click.option("--list", "listed", type=click.Path(path_type=Path), metavar="FILE.csv", help="Members from a table.")
@click.option("--seed", type=click.IntRange(0), default=0, help="Of sobol and lhs (default: 0).")
@click.option(
    "--range", "ranges", metavar="NAME=LOW:HIGH[:log]", multiple=True, callback=sources.limits, help="Range of a parameter."
)
@click.option("--scheduler", metavar="ADDRESS", help="Run on a dask cluster (tcp://host:port) that sees the same files.")
@click.option("--workers", type=click.IntRange(1), help="Processes on this machine (default: one a core).")
@click.option("--timeout", type=float, metavar="SECONDS", help="Give up a member that takes longer.")
@click.option("--resume", is_flag=True, help="Go on with a sweep that was stopped: missing members only.")
@click.option("--duration", type=float, metavar="SECONDS", help="Replace the duration of a scene.")
@click.option("--instants", type=click.IntRange(2), default=601, help="Stored instants of a history, at most (default: 601).")
@click.option("--plots/--no-plots", default=True, help="Draw response, scatter matrix and histories (default: yes).")
def command(
    session: Session,
    samples: str | None,
    design: str | None,
    listed: Path | None,
    seed: int,
    ranges: tuple[Limits, ...],
    scheduler: str | None,
    workers: int | None,
    timeout: float | None,
    resume: bool,
    duration: float | None,
    instants: int,
    plots: bool,
) -> Result:
    """Run many members of SCENE, a scene whose parameters have ranges or a reduced model (NAME.h5) saved by `fmbs train`.

    Every member is stored when it is done, in members/ of the folder --out (default: fmbs-NAME-sweep). At the end the results stand
    in sweep.csv and sweep.h5, with plots. Members that fail, hang or lose their process are listed, the others finish, and the exit
    code is 5. Extremes of outputs are those at the stored instants.
    """
    from ..reduction.sweeps import Options

    options = Options(workers, scheduler, timeout)
    make = sources.saved if session.path.suffix in SAVED else sources.scene
    source = make(session, ranges, duration, instants)
    points = sources.spread(source.parameters, samples, design, listed, seed)
    origin = reports.provenance(source.scene, () if source.scene else (session.path,), {"design": seed}, workers)
    out, done = opened(session, source, points, resume, origin)
    outcome, records = compute(session, source, points, options, out, done)
    origin["threads"]["workers"] = outcome.workers
    return finish(session, source, points, out, outcome, records, origin, plots)


def opened(
    session: Session, source: Source, points: np.ndarray, resume: bool, origin: Mapping[str, Any]
) -> tuple[Path, dict[int, Record]]:
    """The output folder, and the records that are there already."""
    from ..results import sweep_files

    mark = sources.fingerprint(source, points)
    names = (sweep_files.CSV, sweep_files.HDF5, sweep_files.MEMBERS, *PLOTS, SURROGATE, reports.REPORT)
    out = reports.folder(session, f"fmbs-{session.path.stem}-sweep", names, mark)
    same = reports.recorded(out / reports.REPORT) == mark
    there = (out / sweep_files.MEMBERS).exists()
    if there and same and not (resume or session.force):
        remedy = "--resume computes what is missing, --force starts anew"
        raise InputError(say(f"--out {out}", "a new folder", "this sweep, begun before", remedy))
    found: dict[int, Record] = {}
    if there and same and resume:
        found = sweep_files.settled(out, points, [own.name for own in source.parameters])
    elif there:
        sweep_files.forget(out)
    begun = {"status": "running", "fingerprint": mark, "members": len(points), "provenance": origin}
    reports.write_json(out / reports.REPORT, begun)
    return out, found


def compute(
    session: Session, source: Source, points: np.ndarray, options: Options, out: Path, done: Mapping[int, Record]
) -> tuple[Outcome, dict[int, Record]]:
    """Run the missing members; each is stored when it is settled."""
    from ..reduction import sweeps
    from ..results import sweep_files
    from .solving import Interrupted

    records = dict(done)

    def keep(record: Record) -> None:
        sweep_files.write(out, record)
        records[record.number] = record

    if len(done) < len(points):
        options = replace(options, first_alone=screen.announce_compiling())
    with screen.progress(f"{len(points) - len(done)} members") as advance:
        names = [own.name for own in source.parameters]
        try:
            outcome = sweeps.run(source.task, names, points, keep, options, done, advance)
        except sweeps.Stopped as stopped:
            text = f"stopped by {signal.Signals(stopped.number).name} after {len(records)} of {len(points)} members"
            raise Interrupted(stopped.number, f"{text}, which are kept in {out}; go on with the same call and --resume") from None
    return outcome, records


def finish(
    session: Session,
    source: Source,
    points: np.ndarray,
    out: Path,
    outcome: Outcome,
    records: dict[int, Record],
    origin: Mapping[str, Any],
    plots: bool,
) -> Result:
    """Tables, plots and the report of a sweep."""
    from ..results import sweep_files

    table = sweep_files.collect(source.parameters, points, records)
    table = replace(table, numbers=table.numbers | sources.predicted(source, points))
    files = [sweep_files.write_csv(table, out / sweep_files.CSV), sweep_files.write_hdf5(table, out / sweep_files.HDF5)]
    files += [*draw(table, out, source.name), *draw_surrogate(session.path, source, out)] if plots else []
    found = report(source, table, outcome, records) | {"fingerprint": sources.fingerprint(source, points)}
    found |= {"provenance": origin, "files": [*files, out / reports.REPORT]}
    reports.keep(session, out, found)
    error = SweepFailure(found["message"]) if found["failed"] else None
    view = [summary(found), responses(table)]
    view += [failures(found)] if found["failed"] else []
    return Result(found, [*view, "written: " + ", ".join(map(str, found["files"]))], error)


def draw(table: Sweep, out: Path, title: str) -> list[Path]:
    """The plots; none where no member ran."""
    from ..results import sweep_plots

    response, matrix, histories = (out / name for name in PLOTS)
    if not table.columns:
        return []
    return [
        sweep_plots.response(response, table, title=title),
        sweep_plots.scatter_matrix(matrix, table, title=title),
        sweep_plots.fan(histories, table, title=title),
    ]


def draw_surrogate(path: Path, source: Source, out: Path) -> list[Path]:
    """The Kriging surface of the indicator over the trained ranges of a model, with its samples; none without its training."""
    from ..reduction import parametric_model, prediction
    from ..results import training_plots

    if source.predict is None:
        return []
    model = parametric_model.load(path)
    found = prediction.surrogate_of(model)
    return [] if found is None else [training_plots.slices(out / SURROGATE, model.model.parameters, found, title=source.name)]


def report(source: Source, table: Sweep, outcome: Outcome, records: Mapping[int, Record]) -> dict[str, Any]:
    """The JSON object of a sweep."""
    from ..reduction.members import Status
    from ..results import sweep_files

    failed = [record for _, record in sorted(records.items()) if record.status is not Status.OK]
    text = f"{len(failed)} of {len(table.points)} members failed; parameters and reasons are listed in {sweep_files.CSV}"
    return {
        **({"status": "error", "reason": "failed members", "message": text} if failed else {"status": "ok"}),
        "name": source.name,
        "parameters": {
            own.name: {"low": own.low, "high": own.high, "unit": own.unit, "scale": own.scale.value} for own in source.parameters
        },
        "members": len(table.points),
        "computed": sum(outcome.counts.values()),
        **{status.value: sum(found is status for found in table.status) for status in Status if status is not Status.FAILED},
        "outputs": {
            name: {kind: {"min": low(values), "max": -low(-values)} for kind, values in sweep_files.extremes(column).items()}
            for name, column in table.columns.items()
        },
        "predicted_error": {name: -low(-column) for name, column in table.numbers.items()},
        "failed": [
            {"member": one.number, "values": one.values, "status": one.status.value, "reason": one.reason, "message": one.message}
            for one in failed
        ],
        "workers": outcome.workers,
        "workers_lost": outcome.deaths,
        "start_s": outcome.start_s,
        "wall_s": outcome.wall_s,
        "cpu_s": outcome.cpu_s,
        "overhead": outcome.overhead,
    }


def low(values: np.ndarray) -> float:
    """The smallest value; NaN where there is none."""
    import numpy as np

    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else float("nan")


def summary(found: Mapping[str, Any]) -> str:
    """The sweep in one line."""
    text = f"{found['name']}: {found['members']} members in {', '.join(found['parameters'])}, {found['ok']} ok, "
    text += (
        f"{len(found['failed'])} failed; {found['computed']} computed in {found['wall_s']:.3g} s wall ({found['start_s']:.2g} s "
    )
    return (
        text + f"until the first), {found['cpu_s']:.3g} s CPU, {found['workers']} workers, {100 * found['overhead']:.1f} % overhead"
    )


def responses(table: Sweep) -> Any:
    """Range of every output over all members."""
    from ..results import sweep_files

    rows = []
    for name, column in table.columns.items():
        ends = sweep_files.extremes(column)
        final = ends["final"]
        rows.append(
            (sweep_files.headed(name, table.units.get(name, "")), low(ends["min"]), -low(-ends["max"]), low(final), -low(-final))
        )
    return screen.table("Outputs over all members (SI units)", ("output", "min", "max", "smallest final", "largest final"), rows)


def failures(found: Mapping[str, Any]) -> Any:
    """The members that failed."""
    rows = [
        (one["member"], ", ".join(f"{name} = {value:g}" for name, value in one["values"].items()), one["reason"], one["message"])
        for one in found["failed"][:LISTED]
    ]
    more = len(found["failed"]) - len(rows)
    return screen.table("Failed" + (f" (and {more} more)" if more else ""), ("member", "parameters", "reason", "message"), rows)
