"""What is found about one state of a scene, such as vibration modes and buckling loads, as a table,
a report and pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import FmbsError, InputError, say
from ...core.notices import notify
from ...core.values.display import DisplayUnits
from ...core.values.units import add_unit
from ...dynamics.near_state.shapes import say_shares, shares
from ...results import mode_shapes, response_plots, series
from ...results.plots import PANELS
from ...scenes.yamlfile import where
from .. import job as jobs
from .. import kinds, reports
from ..job import Job
from ..result import Figures, ReportTable, conclude, describe_error, list_files
from . import recording
from .outcome import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...dynamics import Shapes, StateSpace
    from ...scenes import Scene
    from ...scenes.analyses.analysis import States, StateTable

SLOW = 1e-7  #: least rate that is drawn, over the largest
DRAWN = 16  #: states up to whose rate is drawn
SAMPLES = 600  #: frequencies
PICTURE, ANIMATION, SERIES = "modes.png", "mode_{}.gif", "modes"

Draw = Callable[["Shapes", Path], Sequence[Callable[[], Path]]]  #: as in `solving`


def solve_states(
    job: Job, scene: Scene, analysis: States, draw: Draw | None = None, names: Sequence[str] = ()
) -> Run:
    """What the analysis of a scene finds, also in its file of columns, and what is drawn of its
    shapes.
    """
    with recording.place(
        job, (analysis.table, *analysis.files, reports.REPORT, *names), reports.fingerprint(scene)
    ):
        with jobs.keep_results():
            found = analysis.find(scene, job.allow_outside)
            notify(*(f"{where(scene, 'analysis')}: {text}" for text in found.doubts))
        error: FmbsError | None = jobs.refused(job)
        shapes = found.shapes
        if draw and shapes is None:
            raise InputError(
                say(
                    "analysis.type",
                    "one that finds shapes, such as modes",
                    analysis.word,
                    "use fmbs run",
                )
            )
        moves = motions(found)
        columns: dict[str, Any] = {**found.columns} | {
            f"share_{name}": values for name, values in moves.get("shares", {}).items()
        }
        # `Hz` of `frequency [Hz]`
        unit_texts = [head.partition("[")[2].rstrip("]") for head in found.heads]
        report: dict[str, Any] = {
            **describe_error(error),
            **jobs.facts(scene, found.raw, found.reduced),
            **found.facts,
            **moves,
            "units": dict.fromkeys(columns, "") | dict(zip(found.columns, unit_texts, strict=True)),
            "notices": job.notices,
        }
        figures = figures_of(found, jobs.title(scene), scene.display)

        def write(out: Path) -> list[Path]:
            spaces = (
                [found.linear.save(out / name) for name in analysis.files] if found.linear else []
            )
            return [reports.write_csv(out / analysis.table, columns), *spaces]

        missing = jobs.deliver(
            job, report, write, figures, partial(draw, shapes) if draw and shapes else None
        )
    heads = [*found.heads]
    rows = [
        [*row] for row in zip(*(values.tolist() for values in found.columns.values()), strict=True)
    ]
    heads, rows = scene.display.columns(heads, rows)
    if shapes is not None:
        heads = [*heads, "what moves"]
        rows = [[*row, text] for row, text in zip(rows, moves["moves"], strict=True)]
    made = Run(
        about=f"{report['scene']}: {found.about}",
        report=report,
        lines=[
            ReportTable(f"{report['scene']}: {found.title}", tuple(heads), rows),
            *kinds.views(report, scene.display),
            *list_files(report),
        ],
        figures=figures,
        error=error or missing,
        outputs={name: np.asarray(values) for name, values in columns.items()},
        frequencies=found.frequencies,
        shapes=shapes,
        linear=found.linear,
    )
    return conclude(made)


def motions(found: StateTable) -> dict[str, Any]:
    """What moves in every row: shares of bodies, and a sentence."""
    if found.shapes is None:
        return {}
    parts = shares(found.shapes)
    free = found.moves or [""] * len(found.shapes.captions)
    return {"shares": parts, "moves": [name or say_shares(parts, k) for k, name in enumerate(free)]}


def figures_of(found: StateTable, title: str, display: DisplayUnits) -> Figures:
    """The transfer functions of a linear system, or a Campbell diagram."""
    if found.linear is not None:
        return Figures({"transfer": partial(transfer, found.linear, title)})
    if found.diagram is None:
        return Figures()
    one = found.diagram
    label = add_unit(found.facts["parameter"], found.facts["unit"])
    orders = max((crossing["order"] for crossing in found.facts["crossings"]), default=0)
    hertz = one.omega / (2.0 * np.pi)
    return Figures(
        {
            "campbell": partial(
                response_plots.campbell,
                one.values,
                hertz,
                one.unstable,
                label,
                orders,
                title,
                display,
            )
        }
    )


def transfer(linear: StateSpace, title: str) -> Figure:
    """Magnitudes of the transfer functions of at most PANELS outputs, over the frequencies of the
    slowest motions.
    """
    rates = np.sort(np.abs(np.linalg.eigvals(linear.A)))
    rates = rates[rates > SLOW * rates[-1]]
    omega = np.geomspace(rates[0] / 5.0, 2.0 * rates[min(len(rates), DRAWN) - 1], SAMPLES)
    found = linear.transfer(omega)
    curves = {
        add_unit(name, linear.units.get(name, "")): {
            f"per {add_unit(one, linear.units[one])}": found[:, i, j]
            for j, one in enumerate(linear.inputs)
        }
        for i, name in enumerate(linear.outputs[:PANELS])
    }
    return response_plots.magnitudes(omega / (2.0 * np.pi), curves, title)


def pictures(
    title: str, frames: int, ending: str, display: DisplayUnits, shapes: Shapes, out: Path
) -> list[Callable[[], Path]]:
    """All motions in one picture, and an animation of each with at most `frames` instants of a
    period (none for 0).
    """
    found: list[Callable[[], Path]] = [
        partial(mode_shapes.picture, shapes, out / PICTURE, title, display)
    ]
    numbers = range(len(shapes.captions)) if frames else ()
    return [
        *found,
        *(
            partial(
                mode_shapes.animate,
                shapes,
                k,
                (out / ANIMATION.format(k + 1)).with_suffix(ending),
                title,
                frames,
                display,
            )
            for k in numbers
        ),
    ]


def write_series(shapes: Shapes, out: Path) -> list[Callable[[], Path]]:
    """The state with every motion as a field."""
    return [partial(series.write, mode_shapes.fields(shapes), out, SERIES)]
