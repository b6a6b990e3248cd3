"""Many samples of a scene or of a saved reduced model, on all cores or on a cluster; files and code
call each a member.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, SweepFailure, closest, listed, say
from ..core.notices import notify
from ..core.storage.records import dataclass
from ..core.values.display import DisplayUnits, largest_of
from ..core.values.units import add_unit
from ..families import parametric_model, prediction, response_surfaces, sensitivity, sweeps
from ..families.members import OUTSIDE, Status
from ..families.sweeps import SweepOptions
from ..reduction import parameters as boxes
from ..results import sweep_files, sweep_plots, training_plots
from . import job as jobs
from . import reports, sweep_sources
from .job import Job
from .result import Figures, ReportTable, Result, conclude, frame, list_files
from .running import compiling
from .running.recording import Interrupted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..families.members import Record
    from ..families.response_surfaces import ResponseSurface
    from ..families.sweeps import SweepOutcome
    from ..results.sweep_files import Sweep
    from ..scenes.schema import Scene
    from .sweep_sources import Members

PLOTS = ("response", "scatter", "statistics", "histories", "surrogate", "sensitivity", "surfaces")
SURFACES = "surfaces.json"
LISTED = 20  #: failed samples in the table on the screen


@dataclass(frozen=True, repr=False, kw_only=True)
class SweepResult(Result):
    """All members of a sweep."""

    samples: Sweep  #: their numbers as arrays

    def table(self) -> Any:
        """The columns of sweep.csv with their units, a row a sample: a pandas DataFrame where
        pandas is installed, else a mapping.

        Numbers are those of `Run.table` of each sample, with the names `OUTPUT min`, `max` and
        `final`.
        """
        return frame(sweep_files.table(self.samples))

    @property
    def points(self) -> np.ndarray:
        """Values (k, d) of the parameters."""
        return self.samples.points

    def surface(self, output: str, kind: str = "final") -> ResponseSurface:
        """The response surface of the min, max or final value of an output, with `predict`;
        InputError where there is none.
        """
        known = {"output": tuple(self.samples.columns), "kind": sweep_files.EXTREMES}
        for what, word in (("output", output), ("kind", kind)):
            if word not in known[what]:
                expected = f"one of {', '.join(known[what])}"
                raise InputError(
                    say(
                        f"SweepResult.surface, {what}",
                        expected,
                        f"'{word}'{closest(word, known[what])}",
                    )
                )
        values = sweep_files.extremes(self.samples, output)[kind]
        found = response_surfaces.fit(self.samples.parameters, self.samples.points, values)
        if found is None:
            raise InputError(
                say(
                    f"SweepResult.surface, {output} {kind}",
                    "an output that varies",
                    "a constant",
                    "take another kind",
                )
            )
        return found

    @property
    def times(self) -> np.ndarray:
        """(k, s) [s]; NaN where a member has no more."""
        return self.samples.times

    @property
    def outputs(self) -> Mapping[str, np.ndarray]:
        """Histories (k, s) by column; NaN of members that failed."""
        return self.samples.columns


def sweep_points(
    job: Job,
    members: Members,
    points: np.ndarray,
    seed: int,
    options: SweepOptions,
    resume: bool,
    indices: bool,
    surfaces: bool,
    statistics: Mapping[str, Sequence[str]],
) -> SweepResult:
    """Members at points (k, d) of the parameters, which a design with a seed gave, with Sobol
    indices, response surfaces and further statistics of outputs.
    """
    sweep_sources.warn_outside(members, points)
    origin = reports.provenance(
        members.scene, () if members.scene else (job.path,), {"design": seed}, options.workers
    )
    mark = sweep_sources.fingerprint(members, points)
    out, done = open_folder(job, members, points, resume, mark, origin)
    outcome, records = compute(job, members, points, options, out, done)
    origin["threads"]["workers"] = outcome.workers
    predicted = sweep_sources.predict_errors(members, points)
    table = sweep_files.collect(members.parameters, points, records)
    statistics = known_statistics(table, statistics)
    table = replace(table, numbers=table.numbers | predicted | columns_of(table, statistics))
    found = indices_of(table) if indices else {}
    fitted = surfaces_of(table) if surfaces else {}
    report = {
        **report_of(members, table, outcome, records),
        "fingerprint": mark,
        **members.display.note,
        "predicted_error": {name: -low(-column) for name, column in predicted.items()},
        **outside_of(table),
        **jobs.planned_report(job),
        "provenance": origin,
        "notices": job.notices,
        **({"sobol_indices": found} if indices else {}),
        **({"response_surfaces": errors_of(fitted)} if surfaces else {}),
    }
    figures = figures_of(job, members, table, found, fitted, statistics)

    def write(out: Path) -> list[Path]:
        files = [
            sweep_files.write_csv(table, out / sweep_files.CSV),
            sweep_files.write_hdf5(table, out / sweep_files.HDF5),
        ]
        return [*files, *([response_surfaces.write(out / SURFACES, fitted)] if fitted else [])]

    jobs.deliver(job, report, write, figures)
    error = SweepFailure(report["message"]) if report["failed"] else None
    tables = [responses(table, members.display), *([sobol_table(found)] if found else [])]
    tables += [surface_table(fitted, table.units, members.display)] if fitted else []
    head = [
        summary(report),
        *(f"{line}, at the nominal parameters" for line in jobs.planned_lines(job)),
    ]
    view: list[ReportTable | str] = [
        *head,
        *tables,
        *([failures(report, members.display)] if error else []),
        *list_files(report),
    ]
    about = f"{report['name']}: {report['ok']} of {report['members']} samples in {', '.join(report['parameters'])}"
    return conclude(
        SweepResult(
            about=about, report=report, lines=view, figures=figures, error=error, samples=table
        )
    )


def open_folder(
    job: Job,
    members: Members,
    points: np.ndarray,
    resume: bool,
    mark: str,
    origin: Mapping[str, Any],
) -> tuple[Path | None, dict[int, Record]]:
    """The output folder, and the records that are there already."""
    names = (
        sweep_files.CSV,
        sweep_files.HDF5,
        sweep_files.MEMBERS,
        SURFACES,
        *(f"{name}.png" for name in PLOTS),
        reports.REPORT,
    )
    out = jobs.settle_folder(job, names, mark)
    if out is None:
        return None, {}
    files = sweep_files.store_of(out)
    found: dict[int, Record] = {}
    same = bool(files.numbers("")) and reports.read_fingerprint(out / reports.REPORT) == mark
    if same and resume:
        found = sweep_files.read_settled(out, points, [own.name for own in members.parameters])
    elif same and not job.force:
        remedy = "--resume computes what is missing, --force starts anew"
        raise InputError(say(f"--out {out}", "a new folder", "this sweep, begun before", remedy))
    else:
        files.forget("")
    begun = {"status": "running", "fingerprint": mark, "members": len(points), "provenance": origin}
    reports.write_json(out / reports.REPORT, begun)
    return out, found


def compute(
    job: Job,
    members: Members,
    points: np.ndarray,
    options: SweepOptions,
    out: Path | None,
    done: Mapping[int, Record],
) -> tuple[SweepOutcome, dict[int, Record]]:
    """Run the missing members; each is stored when it is settled."""
    records = dict(done)
    sweeps.show(done.values())

    def keep(record: Record) -> None:
        if out is not None:
            sweep_files.write(out, record)
        records[record.number] = record

    if len(done) < len(points):
        options = replace(options, first_alone=compiling.announce(job))
    names = [own.name for own in members.parameters]
    advance = job.progress(f"{len(points) - len(done)} samples")
    try:
        return sweeps.run(members.task, names, points, keep, options, done, advance), records
    except sweeps.Stopped as stopped:
        text = f"stopped by {signal.Signals(stopped.number).name} after {len(records)} of {len(points)} samples"
        kept = (
            f", which are kept in {out}; go on with the same call and --resume"
            if out is not None
            else ""
        )
        raise Interrupted(stopped.number, text + kept) from None


def each_value(
    table: Sweep, what: str, rule: Callable[[str, np.ndarray], Any]
) -> dict[str, dict[str, Any]]:
    """What a rule gives of the smallest, largest and last value of every output; None is left out.

    An output whose samples it does not take is left out as well, with a warning that there is no
    such thing as `what`.
    """
    found: dict[str, dict[str, Any]] = {}
    for name in table.columns:
        for kind, values in sweep_files.extremes(table, name).items():
            try:
                one = rule(name, values)
            except InputError as problem:  # of samples that failed: the others are kept
                notify(f"no {what} of {name}: {problem}")
                break
            if one is not None:
                found.setdefault(name, {})[kind] = one
    return found


def indices_of(table: Sweep) -> dict[str, dict[str, Any]]:
    """Sobol indices of the smallest, largest and last value of every output that varies, by
    parameter.
    """
    names = [own.name for own in table.parameters]
    largest = {
        name: float(np.abs(column[np.isfinite(column)]).max(initial=0.0))
        for name, column in table.columns.items()
    }

    def rule(name: str, values: np.ndarray) -> dict[str, Any] | None:
        size = max(
            largest[other]
            for other in largest
            if table.units.get(other, other) == table.units.get(name, name)
        )
        one = sensitivity.indices(values, len(names), size=size)
        if not np.isfinite(one.first).all():
            return None
        parts = {
            "first": one.first,
            "total": one.total,
            "first_error": one.first_error,
            "total_error": one.total_error,
        }
        return {
            key: dict(zip(names, part.tolist(), strict=True)) for key, part in parts.items()
        } | {"rows": one.rows}

    return each_value(table, "Sobol indices", rule)


def surfaces_of(table: Sweep) -> dict[str, dict[str, ResponseSurface]]:
    """Response surfaces of the smallest, largest and last value of every output that varies."""
    return each_value(
        table,
        "response surface",
        lambda name, values: response_surfaces.fit(table.parameters, table.points, values),
    )


def errors_of(found: Mapping[str, Mapping[str, ResponseSurface]]) -> dict[str, Any]:
    """Errors of surfaces at samples that they have not seen, and their correlation lengths."""
    return {
        output: {
            kind: {
                "rms_error": one.rms_error,
                "largest_error": one.largest_error,
                "q2": one.q2,
                "samples": len(one.values),
                "lengths": dict(
                    zip([own.name for own in one.parameters], one.lengths.tolist(), strict=True)
                ),
            }
            for kind, one in kinds.items()
        }
        for output, kinds in found.items()
    }


def surface_table(
    found: Mapping[str, Mapping[str, ResponseSurface]], units: Mapping[str, str], read: DisplayUnits
) -> ReportTable:
    """Errors of all surfaces at samples that they have not seen."""
    rows = []
    for output, kinds in found.items():
        head, size = read.head(
            add_unit(output, units.get(output, "")),
            [largest_of(one.values) for one in kinds.values()],
        )
        for kind, one in kinds.items():
            rows.append((head, kind, one.rms_error / size, one.largest_error / size, one.q2))
    return ReportTable(
        "Response surfaces: errors of unseen samples",
        ("output", "value", "rms error", "largest error", "q2"),
        rows,
    )


def sobol_table(found: Mapping[str, Any]) -> ReportTable:
    """The indices of the last values, or of another one where that does not vary."""
    chosen = dict(sweep_plots.choose_kind(name, kinds) for name, kinds in found.items())
    names = list(next(iter(chosen.values()))["first"])
    heads = ("output", *(f"S {name}" for name in names), *(f"ST {name}" for name in names))
    rows = [(name, *one["first"].values(), *one["total"].values()) for name, one in chosen.items()]
    return ReportTable(
        "Sobol indices of the last values, or of those named: alone (S), with all others (ST)",
        heads,
        rows,
    )


def check_statistics(wanted: Mapping[str, Sequence[str]], scene: Scene | None) -> None:
    """InputError for statistics that there are none of, and outputs that a scene has not, before
    anything runs.
    """
    known = sweep_files.STATISTICS
    for output, kinds in wanted.items():
        names = [] if scene is None else list(scene.outputs)
        if names and not any(output == one or output.startswith(f"{one}_") for one in names):
            got = f"'{output}'{closest(output, names)}"
            raise InputError(say("statistic", f"a column of {listed(names, output)}", got))
        for kind in kinds:
            if kind not in known:
                got = f"'{kind}'{closest(kind, known)}"
                raise InputError(say(f"statistic of {output}", f"one of {', '.join(known)}", got))


def known_statistics(table: Sweep, wanted: Mapping[str, Sequence[str]]) -> dict[str, Sequence[str]]:
    """Those of outputs that the members have; the others are left out with a warning, since all that
    was computed is kept.
    """
    for name in (name for name in wanted if name not in table.columns):
        expected = f"an output, one of {listed(list(table.columns), name, 'none')}"
        remedy = "name it and go on with --resume, which runs nothing again"
        notify(say("statistic", expected, f"'{name}'{closest(name, table.columns)}", remedy))
    return {name: kinds for name, kinds in wanted.items() if name in table.columns}


def columns_of(table: Sweep, statistics: Mapping[str, Sequence[str]]) -> dict[str, np.ndarray]:
    """Columns of statistics that every table does not have, by their heads."""
    return {
        add_unit(f"{name} {kind}", table.units.get(name, "")): sweep_files.statistics(table, name)[
            kind
        ]
        for name, kinds in statistics.items()
        for kind in kinds
        if kind not in sweep_files.EXTREMES
    }


def figures_of(
    job: Job,
    members: Members,
    table: Sweep,
    found: Mapping[str, Any],
    fitted: Mapping[str, Any],
    statistics: Mapping[str, Sequence[str]],
) -> Figures:
    """Response, scatter matrix and histories where a member ran, the surrogate of a model that has
    a record of its training.

    And indices, surfaces and statistics that were found.
    """
    rules: dict[str, Callable[[], Figure]] = {}
    shared: dict[str, Any] = {"title": members.name, "display": members.display}
    if table.columns:
        rules["response"] = partial(sweep_plots.response, table, **shared)
        rules["scatter"] = partial(sweep_plots.scatter_matrix, table, **shared)
        if statistics:
            rules["statistics"] = partial(sweep_plots.over_parameters, table, statistics, **shared)
        across = (
            "load factor"
            if members.scene is not None and not members.scene.analysis.clock
            else "time [s]"
        )
        if not (
            np.diff(table.times, axis=1) <= 0.0
        ).any():  # as along a path whose load factor turns
            rules["histories"] = partial(sweep_plots.fan, table, across=across, **shared)
    if members.predict is not None:
        model = parametric_model.load(job.path)
        if (known := prediction.read_record(model)) is not None:
            rules["surrogate"] = partial(
                training_plots.slices,
                model.model.parameters,
                known[0],
                title=members.name,
                display=members.display,
            )
    if found:
        rules["sensitivity"] = partial(sweep_plots.sensitivity, found, title=members.name)
    if fitted:
        rules["surfaces"] = partial(sweep_plots.surfaces, fitted, table.units, **shared)
    return Figures(rules)


def report_of(
    members: Members, table: Sweep, outcome: SweepOutcome, records: Mapping[int, Record]
) -> dict[str, Any]:
    """The JSON object of a sweep."""
    failed = [record for _, record in sorted(records.items()) if record.status is not Status.OK]
    text = f"{len(failed)} of {len(table.points)} samples failed; parameters and reasons are listed in {sweep_files.CSV}"
    return {
        **(
            {"status": "error", "reason": "failed samples", "message": text}
            if failed
            else {"status": "ok"}
        ),
        "name": members.name,
        "parameters": boxes.described(members.parameters),
        "members": len(table.points),
        "computed": sum(outcome.counts.values()),
        **{
            status.value: sum(found is status for found in table.status)
            for status in Status
            if status is not Status.FAILED
        },
        "outputs": {
            name: {
                kind: {"min": low(values), "max": -low(-values)}
                for kind, values in sweep_files.extremes(table, name).items()
            }
            for name in table.columns
        },
        "failed": [
            {
                "member": one.number,
                "values": one.values,
                "status": one.status.value,
                "reason": one.reason,
                "message": one.message,
            }
            for one in failed
        ],
        "workers": outcome.workers,
        "workers_lost": outcome.deaths,
        "start_s": outcome.start_s,
        "wall_s": outcome.wall_s,
        "cpu_s": outcome.cpu_s,
        "overhead": outcome.overhead,
    }


def outside_of(table: Sweep) -> dict[str, Any]:
    """Members in which parts leave their training, with the number of parts; nothing where no part
    knows its own.
    """
    if OUTSIDE not in table.numbers:
        return {}
    counts = table.numbers[OUTSIDE]
    names = [own.name for own in table.parameters]
    found = [
        {
            "member": k,
            "values": dict(zip(names, table.points[k].tolist(), strict=True)),
            "parts": int(counts[k]),
        }
        for k in np.flatnonzero(counts > 0.0).tolist()
    ]
    return {"outside_training": found}


def low(values: np.ndarray) -> float:
    """The smallest value; NaN where there is none."""
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else float("nan")


def summary(found: Mapping[str, Any]) -> str:
    """The sweep in one line."""
    text = f"{found['name']}: {found['members']} samples in {', '.join(found['parameters'])}, {found['ok']} ok, "
    text += f"{len(found['failed'])} failed; {found['computed']} computed in {found['wall_s']:.3g} s wall ({found['start_s']:.2g} s "
    return (
        text
        + f"until the first), {found['cpu_s']:.3g} s CPU, {found['workers']} workers, {100 * found['overhead']:.1f} % overhead"
    )


def responses(table: Sweep, read: DisplayUnits) -> ReportTable:
    """Range of every output over all members."""
    rows = []
    for name in table.columns:
        ends = sweep_files.extremes(table, name)
        final = ends["final"]
        values = [low(ends["min"]), -low(-ends["max"]), low(final), -low(-final)]
        head, shown = read.row(add_unit(name, table.units.get(name, "")), values)
        rows.append((head, *shown))
    return ReportTable(
        "Outputs over all samples",
        ("output", "min", "max", "smallest final", "largest final"),
        rows,
    )


def failures(found: Mapping[str, Any], read: DisplayUnits) -> ReportTable:
    """The members that failed."""
    rows = []
    for one in found["failed"][:LISTED]:
        values = [
            read.text(name, value, found["parameters"][name]["unit"])
            for name, value in one["values"].items()
        ]
        rows.append((one["member"], ", ".join(values), one["reason"], one["message"]))
    more = len(found["failed"]) - len(rows)
    return ReportTable(
        "Failed" + (f" (and {more} more)" if more else ""),
        ("sample", "parameters", "reason", "message"),
        rows,
    )
