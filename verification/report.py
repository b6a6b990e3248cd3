"""The registered cases beside their published and exact references, as a table, a page, JSON and
pictures.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from fmbs_skfem import __version__
from fmbs_skfem.core.errors import FmbsError
from fmbs_skfem.core.storage import durable
from fmbs_skfem.core.storage.records import dataclass
from fmbs_skfem.studies import job as jobs
from fmbs_skfem.studies import reports
from fmbs_skfem.studies.job import Job
from fmbs_skfem.studies.result import Figures, ReportTable, Result, conclude
from fmbs_skfem.studies.running import compiling

from . import plots, registry

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .registry import CheckedNumber, Outcome, VerificationCase

PAGE, RECORD = "verification.md", "verification.json"
TITLES = {
    "statics": "Large deflections and limit points",
    "vibration": "Natural frequencies",
    "dynamics": "Flexible bodies in motion",
    "rigid": "Rigid bodies and rigid limits",
    "integrator": "Time integrator",
    "manufactured": "Manufactured solutions: every law, every interpolation",
}
HEAD = """\
# Verification

Written by `fmbs verify --out docs` (version {version}). {cases} cases, {quantities} quantities, {good} within their tolerance;
{seconds:.0f} s of CPU time. The tests run the same cases.

The difference is |ours - reference| / |reference|; for tables it is the largest one, relative to the table's largest number where
entries pass through zero, and the entry shown is the one that is farthest off. The order is the observed exponent of the error in
the mesh size or step. *own*: a stored figure of this package, not a reference. *recomputed*: the digits were computed anew by a
separate program from the equations of the source, and agree with what it prints.
"""
OUTSIDE_HEAD = """\
## What is outside

Cables have neither torsion nor transverse shear, plates and shells are of the Kirchhoff-Love kind, and rotary inertia is left out.
These published cases need one of them:
"""


class VerificationFailure(FmbsError):
    """Some cases are off their references; the others are kept."""

    exit_code = 4


@dataclass(frozen=True, repr=False, kw_only=True)
class Verification(Result):
    """Outcomes of cases."""

    outcomes: Sequence[Outcome]


def cases(names: Sequence[str], groups: Sequence[str]) -> Verification:
    """The cases and what they are; nothing is solved."""
    found = registry.find(tuple(names), tuple(groups))
    rows = [(case.name, case.group, case.about) for case in found]
    report = {"status": "ok", "cases": [heading(case) for case in found], "notices": []}
    table = ReportTable("Cases", ("case", "group", "about"), rows)
    return Verification(about=f"{len(found)} cases", report=report, lines=[table], outcomes=())


def verify_cases(job: Job, names: Sequence[str], groups: Sequence[str]) -> Verification:
    """Cases beside their references; the page, the JSON file and the pictures are those of all that
    were chosen.
    """
    chosen = registry.find(tuple(names), tuple(groups))
    mark = hashlib.sha256(repr((__version__, [case.name for case in chosen])).encode()).hexdigest()
    pictures = [f"verification_{group}" for group in dict.fromkeys(case.group for case in chosen)]
    out = jobs.settle_folder(
        job, [PAGE, RECORD, *(f"{name}.png" for name in pictures)], mark, RECORD
    )
    compiling.announce(job)
    advance, outcomes = job.progress("verification"), list[registry.Outcome]()
    for number, case in enumerate(chosen, 1):
        outcomes.append(registry.run(case))
        advance(number / len(chosen))
    wrong = [outcome.case.name for outcome in outcomes if not outcome.holds]
    report: dict[str, Any] = {
        "status": "error" if wrong else "ok",
        "failed": wrong,
        "cases": [record(outcome) for outcome in outcomes],
        "fingerprint": mark,
        "provenance": reports.provenance(),
        "notices": job.notices,
    }
    figures = Figures(
        {f"verification_{group}": partial(draw, group, outcomes) for group in by_group(outcomes)}
    )
    if out is not None:
        drawn = figures.save(out)
        with durable.place(out / PAGE) as part:
            part.write_text(page(outcomes), encoding="utf-8")
        report["files"] = [out / PAGE, out / RECORD, *drawn]
        reports.write_report(
            out, {**report, "files": [path.name for path in report["files"]]}, RECORD
        )
    error = VerificationFailure(f"off their references: {', '.join(wrong)}") if wrong else None
    about = f"{len(outcomes) - len(wrong)} of {len(outcomes)} cases hold"
    found = Verification(
        about=about,
        report=report,
        lines=view(outcomes),
        figures=figures,
        error=error,
        outcomes=outcomes,
    )
    return conclude(found)


def heading(case: VerificationCase) -> dict[str, str]:
    return {"case": case.name, "group": case.group, "about": case.about, "source": case.source}


def by_group(outcomes: Sequence[Outcome]) -> Mapping[str, Sequence[Outcome]]:
    """Outcomes by group."""
    groups = dict.fromkeys(outcome.case.group for outcome in outcomes)
    return {
        group: [outcome for outcome in outcomes if outcome.case.group == group] for group in groups
    }


def draw(group: str, outcomes: Sequence[Outcome]) -> Figure:
    """The picture of a group."""
    mine = by_group(outcomes)[group]
    dots = {o.case.name: [(q.difference, q.tolerance) for q in o.quantities] for o in mine}
    curves = {o.case.name: {q.name: q.curve for q in o.quantities if q.curve} for o in mine}
    return plots.group(TITLES[group], dots, curves)


def record(outcome: Outcome) -> dict[str, Any]:
    """An outcome for the JSON file."""
    quantities = [
        {**vars(quantity), "difference": quantity.difference, "holds": quantity.holds}
        for quantity in outcome.quantities
    ]
    result = {
        "holds": outcome.holds,
        "cpu_s": round(outcome.seconds, 3),
        "error": outcome.error,
        "quantities": quantities,
    }
    return {**heading(outcome.case), **result}


def view(outcomes: Sequence[Outcome]) -> list[ReportTable | str]:
    """The table of all quantities, and what failed."""
    rows = [
        (
            outcome.case.name if not number else "",
            *cells(quantity),
            f"{outcome.seconds:.1f}" if not number else "",
        )
        for outcome in outcomes
        for number, quantity in enumerate(outcome.quantities)
    ]
    heads = (
        "case",
        "quantity",
        "reference",
        "ours",
        "difference",
        "tolerance",
        "order",
        "",
        "CPU [s]",
    )
    lines = [f"{outcome.case.name}: {outcome.error}" for outcome in outcomes if outcome.error]
    good = sum(quantity.holds for outcome in outcomes for quantity in outcome.quantities)
    total = sum(len(outcome.quantities) for outcome in outcomes)
    return [
        ReportTable("Verification", heads, rows),
        *lines,
        f"{good} of {total} quantities are within their tolerance",
    ]


def cells(quantity: CheckedNumber) -> tuple[str, ...]:
    """Quantity, reference and value with unit, difference, tolerance, order, remark."""
    unit = f" {quantity.unit}" if quantity.unit else ""
    remark = ("" if quantity.holds else "off ") + ("own" if quantity.kind == "own" else "")
    return (
        quantity.name,
        f"{quantity.reference:.9g}{unit}",
        f"{quantity.value:.9g}{unit}",
        f"{quantity.difference:.1e}",
        f"{quantity.tolerance:.0e}",
        "" if quantity.order is None else f"{quantity.order:.2f}",
        remark.strip(),
    )


def page(outcomes: Sequence[Outcome]) -> str:
    """The page: summary, a section a group, a table a case, and what is outside."""
    quantities = [quantity for outcome in outcomes for quantity in outcome.quantities]
    counts = {
        "cases": len(outcomes),
        "quantities": len(quantities),
        "good": sum(quantity.holds for quantity in quantities),
    }
    parts = [
        HEAD.format(
            version=__version__, seconds=sum(outcome.seconds for outcome in outcomes), **counts
        ),
        summary(outcomes),
    ]
    for group, mine in by_group(outcomes).items():
        parts.append(f"## {TITLES[group]}\n\n![{TITLES[group]}](verification_{group}.png)\n")
        parts += [section(outcome) for outcome in mine]
    parts.append(
        f"{OUTSIDE_HEAD}\n{ReportTable('Outside', ('case', 'source', 'why'), registry.OUTSIDE).markdown}"
    )
    return "\n".join(parts)


def summary(outcomes: Sequence[Outcome]) -> str:
    """A row a case: what it is, how many of its quantities hold, CPU time."""
    rows = []
    for outcome in outcomes:
        case, good = outcome.case, sum(quantity.holds for quantity in outcome.quantities)
        found = f"{good} of {len(outcome.quantities)}"
        rows.append(
            (
                f"[{case.name}](#{case.name})",
                case.group,
                case.about,
                found,
                f"{outcome.seconds:.1f}",
            )
        )
    return ReportTable(
        "Cases", ("case", "group", "problem", "within tolerance", "CPU [s]"), rows
    ).markdown


def section(outcome: Outcome) -> str:
    """A case: what it is, its source, and a row a quantity."""
    case = outcome.case
    head = f"### {case.name}\n\n{case.about}\n\nSource: {case.source}. CPU time {outcome.seconds:.1f} s.\n"
    if outcome.error:
        return f"{head}\n**It failed**: {outcome.error}\n"
    names = (
        "quantity",
        "reference",
        "ours",
        "relative difference",
        "tolerance",
        "order observed",
        "",
    )
    return f"{head}\n{ReportTable(case.name, names, [cells(quantity) for quantity in outcome.quantities]).markdown}"
