r"""Files of a sweep: a record for every member, complete or not at all, and one table of all of
them.

    members/000017.h5    as soon as the member is settled
    sweep.csv            a row a member: parameters, smallest, largest and last value of every output, parts that
                         leave their training, status, cost
    sweep.h5             parameters (k, d), status, times and histories (k, s)

All are written beside their place, flushed to the disk and renamed. Whatever ends a sweep leaves
the records so far, so that it can go on with the members that are missing. Arrays carry HDF5's
Fletcher-32 checksums; a record that cannot be read counts as missing. Headers of the table:
`E [Pa]`, `C_z max`, ..., in SI units.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import CorruptFile, InputError, say
from ..core.notices import notify
from ..core.storage import container, durable
from ..core.storage.container import Dataset, FileKind
from ..core.storage.records import dataclass
from ..core.storage.store import Store
from ..core.values import tables
from ..core.values.ranges import Parameter
from ..core.values.units import add_unit
from ..families.members import Record, Status

MEMBERS = "members"
CSV, HDF5 = "sweep.csv", "sweep.h5"
FORMAT = "fmbs_skfem sweep"
VERSION = 1
KIND = FileKind("fmbs_skfem sweep record", "a record", "remove it and go on with --resume")
RESUME = "what is there is kept; make room and go on with --resume"
EXTREMES = ("min", "max", "final")
STATISTICS = (*EXTREMES, "range", "mean", "rms")
TAKEN = ("member", "status", "reason", "message")  #: headers beside those of parameters and outputs


@dataclass(frozen=True)
class Sweep:
    """All members of a sweep; numbers of members without result are NaN."""

    parameters: tuple[Parameter, ...]
    points: np.ndarray  #: (k, d)
    status: tuple[Status | None, ...]  #: (k,), None for members that are missing
    reasons: tuple[str, ...]  #: (k,)
    messages: tuple[str, ...]  #: (k,)
    cpu_s: np.ndarray  #: (k,)
    times: np.ndarray  #: (k, s) [s]
    columns: dict[str, np.ndarray]  #: output -> (k, s)
    units: dict[str, str]  #: output -> SI unit, where it is known
    numbers: dict[str, np.ndarray]  #: further results -> (k,)
    #: output -> smallest and largest value (k, 2), where known apart
    ends: dict[str, np.ndarray] = field(default_factory=dict)


def store_of(folder: Path) -> Store:
    """The records of a sweep."""
    return Store(folder / MEMBERS, KIND, 6, RESUME)


def write(folder: Path, record: Record) -> None:
    """Store the record of a member: complete under its name, or not at all."""
    store_of(folder).append("", record.number, record)


def read(folder: Path, number: int) -> Record:
    """The record of a member; CorruptFile where it is not as it was written, or not there."""
    found: Record = store_of(folder).read("", number, Record, needed=True)
    return found


def read_settled(folder: Path, points: np.ndarray, names: Sequence[str]) -> dict[int, Record]:
    """Records of the members at `points` that can be read, by number; others count as missing, with
    a warning.

    Those that took too long or too much memory, or whose process ended, are missing as well.
    """
    found: dict[int, Record] = {}
    for number in store_of(folder).numbers(""):
        if number >= len(points):
            continue
        try:
            record = read(folder, number)
            if record.values != dict(zip(names, points[number].tolist(), strict=True)):
                path = store_of(folder).path("", number)
                raise CorruptFile(f"{path}: a record of another sample")
        except CorruptFile as problem:
            notify(f"{problem}; the sample counts as missing")
            continue
        if record.final:
            found[number] = record
    return found


def collect(
    parameters: Sequence[Parameter], points: np.ndarray, records: Mapping[int, Record]
) -> Sweep:
    """All members side by side."""
    count = len(points)
    results = {k: record.result for k, record in records.items() if record.result is not None}
    samples = max((len(result.times) for result in results.values()), default=0)
    names = dict.fromkeys(name for result in results.values() for name in result.columns)
    extra = dict.fromkeys(name for result in results.values() for name in result.numbers)
    times = np.full((count, samples), np.nan)
    columns = {name: np.full((count, samples), np.nan) for name in names}
    numbers = {name: np.full(count, np.nan) for name in extra}
    ends = {name: np.full((count, 2), np.nan) for name in names}
    for k, result in results.items():
        times[k, : len(result.times)] = result.times
        for name, values in result.columns.items():
            columns[name][k, : len(values)] = values
            ends[name][k] = result.extremes.get(name, np.nan)
        for name, value in result.numbers.items():
            numbers[name][k] = value
    known = [records.get(k) for k in range(count)]
    return Sweep(
        tuple(parameters),
        points,
        tuple(record.status if record else None for record in known),
        tuple(record.reason if record else "" for record in known),
        tuple(record.message if record else "" for record in known),
        np.array([record.cpu_s if record else np.nan for record in known]),
        times,
        columns,
        {name: unit for result in results.values() for name, unit in result.units.items()},
        numbers,
        ends,
    )


def extremes(sweep: Sweep, output: str) -> dict[str, np.ndarray]:
    """Smallest, largest and last value (k,) of an output; NaN where there is none.

    Those of the history, unless smaller and larger ones between its instants are known.
    """
    values = sweep.columns[output]
    if not values.shape[1]:
        return dict.fromkeys(EXTREMES, np.full(len(values), np.nan))
    there = np.isfinite(values)
    more = sweep.ends.get(output, np.full((len(values), 2), np.nan))
    last = values.shape[1] - 1 - there[:, ::-1].argmax(axis=1)
    final = values[np.arange(len(values)), last]
    known = np.column_stack([np.where(there, values, np.nan), more])
    return {
        "min": np.fmin.reduce(known, axis=1),
        "max": np.fmax.reduce(known, axis=1),
        "final": final,
    }


def statistics(sweep: Sweep, output: str) -> dict[str, np.ndarray]:
    r"""`extremes` (k,) of an output, its range max - min, and over its stored instants, between which
    it is taken as linear,

        mean = int x dt / T,    rms = sqrt(int x^2 dt / T)
    """
    found = extremes(sweep, output)
    a, b = sweep.columns[output][:, :-1], sweep.columns[output][:, 1:]
    dt = np.where(np.isfinite(a + b), np.abs(np.diff(sweep.times, axis=1)), 0.0)
    T = dt.sum(axis=1)
    none = np.full(len(T), np.nan)
    first, second = (
        np.divide(np.nansum(dt * values, axis=1), T, out=none.copy(), where=T > 0.0)
        for values in ((a + b) / 2.0, (a * a + a * b + b * b) / 3.0)
    )
    return found | {
        "range": found["max"] - found["min"],
        "mean": first,
        "rms": np.sqrt(np.maximum(second, 0.0)),
    }


def check_names(parameters: Sequence[Parameter]) -> None:
    """Raises an InputError for a parameter whose header is that of another column of the table."""
    for own in parameters:
        if add_unit(own.name, own.unit) in TAKEN:
            expected = f"another name than {', '.join(TAKEN)}, columns of {CSV}"
            raise InputError(say(f"parameter '{own.name}'", expected, "one of them", "rename it"))


def table(sweep: Sweep) -> dict[str, Sequence[Any] | np.ndarray]:
    """The columns of sweep.csv by their headers."""
    check_names(sweep.parameters)
    found: dict[str, Sequence[Any] | np.ndarray] = {"member": range(len(sweep.points))}
    found |= {add_unit(p.name, p.unit): sweep.points[:, k] for k, p in enumerate(sweep.parameters)}
    for name in sweep.columns:
        unit = sweep.units.get(name, "")
        found |= {
            add_unit(f"{name} {kind}", unit): column
            for kind, column in extremes(sweep, name).items()
        }
    found |= sweep.numbers
    found |= {
        "status": [status.value if status else "missing" for status in sweep.status],
        "reason": sweep.reasons,
    }
    return found | {"message": sweep.messages, "cpu_s [s]": sweep.cpu_s}


def write_csv(sweep: Sweep, target: Path) -> Path:
    """The table; cells without number are empty."""
    columns = table(sweep)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(
        zip(*([cell(value) for value in column] for column in columns.values()), strict=True)
    )
    return durable.write(target, text.getvalue().encode(), RESUME)


def cell(value: Any) -> str:
    """A value of the table; one line, no number where there is none."""
    if isinstance(value, float):
        return f"{value:.15g}" if np.isfinite(value) else ""
    return " ".join(str(value).split())


def write_hdf5(sweep: Sweep, target: Path) -> Path:
    """The table with the histories."""
    names = {
        "names": [p.name for p in sweep.parameters],
        "units": [p.unit for p in sweep.parameters],
    }
    content = {
        "format": FORMAT,
        "version": VERSION,
        "parameters": Dataset(sweep.points, names),
        "status": [status.value if status else "missing" for status in sweep.status],
        "reason": list(sweep.reasons),
        "message": list(sweep.messages),
        "cpu_s": sweep.cpu_s,
        "times": pack(shared_times(sweep.times), "s"),
        "histories": {
            name: pack(column, sweep.units.get(name, "")) for name, column in sweep.columns.items()
        },
    }
    return durable.write(
        target,
        container.image(content | ({"numbers": sweep.numbers} if sweep.numbers else {})),
        RESUME,
    )


def pack(values: np.ndarray, unit: str) -> Dataset:
    """Histories, checked and packed."""
    return Dataset(
        values,
        {"unit": unit},
        {"compression": "lzf", "shuffle": True, "fletcher32": True} if values.size else {},
    )


def shared_times(times: np.ndarray) -> np.ndarray:
    """Times (s,) where all members have the same, otherwise (k, s)."""
    there = times[np.isfinite(times).any(axis=1)]
    return (
        there[0]
        if len(there)
        and np.array_equal(there, np.broadcast_to(there[0], there.shape), equal_nan=True)
        else times
    )


def read_points(place: Path, parameters: Sequence[Parameter]) -> list[dict[str, float]]:
    """Rows of a CSV file whose header names parameters, with units where the numbers are not SI:
    `E [GPa]`.

    Columns of other names, such as those of a table of results, are left out.
    """
    titles, rows = tables.read_rows(str(place), place)
    missing = {own.name for own in parameters} - {name for name, _ in titles}
    if missing or not rows:
        got = f"{', '.join(name for name, _ in titles) or 'no header'} and {len(rows)} rows"
        wanted = ", ".join(own.name for own in parameters)
        raise InputError(say(str(place), f"a header with {wanted} and a row for each sample", got))
    columns = {own: tables.find_column(str(place), titles, own.name) for own in parameters}
    found = {
        own.name: (k, tables.size_of(str(place), titles[k], own.unit)) for own, k in columns.items()
    }
    return [
        {
            name: tables.number(str(place), row, column, line) * size
            for name, (column, size) in found.items()
        }
        for line, row in enumerate(rows, 2)
    ]
