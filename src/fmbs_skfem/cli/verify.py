"""`fmbs verify`: the registered cases beside their published and exact references, as a table, a page, JSON and pictures."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .. import __version__
from ..core import durable
from ..core.errors import FmbsError
from . import common, reports, screen
from .common import Result, Session

if TYPE_CHECKING:
    from ..verification import Case, Outcome, Quantity

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


@common.command("verify", scene=False)
@click.option("--case", "names", metavar="NAME", multiple=True, help="A case; may be given several times.")
@click.option("--group", "groups", metavar="GROUP", multiple=True, help="A group of cases; may be given several times.")
@click.option("--list", "listed", is_flag=True, help="List the cases and solve nothing.")
def command(session: Session, names: tuple[str, ...], groups: tuple[str, ...], listed: bool) -> Result:
    """Solve the cases of the verification suite (all by default) and hold them against their references.

    --out writes verification.md, verification.json and a picture a group. The exit code is 4 when a quantity is off.
    """
    from .. import verification

    cases = verification.find(names, groups)
    if listed:
        return Result({"status": "ok", "cases": [heading(case) for case in cases]}, [overview(cases)])
    mark = hashlib.sha256(repr((__version__, [case.name for case in cases])).encode()).hexdigest()
    pictures = [f"verification_{group}.png" for group in dict.fromkeys(case.group for case in cases)]
    out = reports.folder(session, session.out, [PAGE, RECORD, *pictures], mark, RECORD) if session.out else None
    outcomes = solved(cases)
    wrong = [outcome.case.name for outcome in outcomes if not outcome.holds]
    error = VerificationFailure(f"off their references: {', '.join(wrong)}") if wrong else None
    found: dict[str, Any] = {
        "status": "error" if wrong else "ok",
        "failed": wrong,
        "cases": [record(outcome) for outcome in outcomes],
        "fingerprint": mark,
        "provenance": reports.provenance(),
    }
    if out is not None:
        found["files"] = written(session, out, outcomes, found)
    return Result(found, view(outcomes), error)


def solved(cases: Sequence[Case]) -> list[Outcome]:
    """Outcomes of all cases, one after another."""
    from .. import verification

    screen.announce_compiling()
    found = []
    with screen.progress("verification") as advance:
        for number, case in enumerate(cases, 1):
            found.append(verification.run(case))
            advance(number / len(cases))
    return found


def heading(case: Case) -> dict[str, str]:
    return {"case": case.name, "group": case.group, "about": case.about, "source": case.source}


def record(outcome: Outcome) -> dict[str, Any]:
    """An outcome for the JSON file."""
    quantities = [{**vars(quantity), "difference": quantity.difference, "holds": quantity.holds} for quantity in outcome.quantities]
    result = {"holds": outcome.holds, "cpu_s": round(outcome.seconds, 3), "error": outcome.error, "quantities": quantities}
    return {**heading(outcome.case), **result}


# --------------------------------------------------------------------------------------------------------------- screen
def overview(cases: Sequence[Case]) -> Any:
    """The cases and what they are."""
    return screen.table("Cases", ("case", "group", "about"), [(case.name, case.group, case.about) for case in cases])


def view(outcomes: Sequence[Outcome]) -> list[Any]:
    """The table of all quantities, and what failed."""
    rows = [
        (outcome.case.name if not number else "", *cells(quantity), f"{outcome.seconds:.1f}" if not number else "")
        for outcome in outcomes
        for number, quantity in enumerate(outcome.quantities)
    ]
    heads = ("case", "quantity", "reference", "ours", "difference", "tolerance", "order", "", "CPU [s]")
    lines = [f"{outcome.case.name}: {outcome.error}" for outcome in outcomes if outcome.error]
    good = sum(quantity.holds for outcome in outcomes for quantity in outcome.quantities)
    total = sum(len(outcome.quantities) for outcome in outcomes)
    return [screen.table("Verification", heads, rows), *lines, f"{good} of {total} quantities are within their tolerance"]


def cells(quantity: Quantity) -> tuple[str, ...]:
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


# ---------------------------------------------------------------------------------------------------------------- files
def written(session: Session, out: Path, outcomes: Sequence[Outcome], found: dict[str, Any]) -> list[Path]:
    """Page, JSON and pictures."""
    pictures = drawn(out, outcomes)
    with durable.place(out / PAGE) as part:
        part.write_text(page(outcomes, {group: path.name for group, path in pictures.items()}), encoding="utf-8")
    files = [out / PAGE, out / RECORD, *pictures.values()]
    reports.keep(session, out, {**found, "files": [path.name for path in files]}, RECORD)
    return files


def drawn(out: Path, outcomes: Sequence[Outcome]) -> dict[str, Path]:
    """A picture for every group."""
    from ..results import verification_plots

    found = {}
    for group in dict.fromkeys(outcome.case.group for outcome in outcomes):
        mine = [outcome for outcome in outcomes if outcome.case.group == group]
        dots = {o.case.name: [(q.difference, q.tolerance) for q in o.quantities] for o in mine}
        curves = {o.case.name: {q.name: q.curve for q in o.quantities if q.curve} for o in mine}
        found[group] = verification_plots.group(out / f"verification_{group}.png", TITLES[group], dots, curves)
    return found


def page(outcomes: Sequence[Outcome], pictures: dict[str, str]) -> str:
    """The page: summary, a section a group, a table a case, and what is outside."""
    from ..verification import OUTSIDE

    quantities = [quantity for outcome in outcomes for quantity in outcome.quantities]
    counts = {"cases": len(outcomes), "quantities": len(quantities), "good": sum(quantity.holds for quantity in quantities)}
    parts = [HEAD.format(version=__version__, seconds=sum(outcome.seconds for outcome in outcomes), **counts), summary(outcomes)]
    for group in dict.fromkeys(outcome.case.group for outcome in outcomes):
        mine = [outcome for outcome in outcomes if outcome.case.group == group]
        parts.append(f"## {TITLES[group]}\n\n![{TITLES[group]}]({pictures[group]})\n")
        parts += [section(outcome) for outcome in mine]
    rows = [f"| {name} | {source} | {reason} |" for name, source, reason in OUTSIDE]
    parts.append("\n".join([OUTSIDE_HEAD, "| case | source | why |", "|---|---|---|", *rows]) + "\n")
    return "\n".join(parts)


def summary(outcomes: Sequence[Outcome]) -> str:
    """A row a case: what it is, how many of its quantities hold, CPU time."""
    rows = []
    for outcome in outcomes:
        case, good = outcome.case, sum(quantity.holds for quantity in outcome.quantities)
        name, about = f"[{case.name}](#{case.name})", case.about.replace("|", "\\|")
        rows.append(f"| {name} | {case.group} | {about} | {good} of {len(outcome.quantities)} | {outcome.seconds:.1f} |")
    return "\n".join(["| case | group | problem | within tolerance | CPU [s] |", "|---|---|---|---|---|", *rows]) + "\n"


def section(outcome: Outcome) -> str:
    """A case: what it is, its source, and a row a quantity."""
    case = outcome.case
    head = f"### {case.name}\n\n{case.about}\n\nSource: {case.source}. CPU time {outcome.seconds:.1f} s.\n"
    if outcome.error:
        return f"{head}\n**It failed**: {outcome.error}\n"
    names = ("quantity", "reference", "ours", "relative difference", "tolerance", "order observed", "")
    rows = [" | ".join(text.replace("|", "\\|") for text in cells(quantity)) for quantity in outcome.quantities]
    return "\n".join([head, f"| {' | '.join(names)} |", "|" + "---|" * len(names), *(f"| {row} |" for row in rows)]) + "\n"
