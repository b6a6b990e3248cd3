"""What is found about one state of a scene, such as vibration modes and buckling loads, as a table and a report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..results import segments
from . import recording, reports
from .job import Job
from .result import Table, list_files
from .runs import Run, heading, sizes

if TYPE_CHECKING:
    from ..scenes import Scene
    from ..scenes.analyses import States


def solve_states(job: Job, scene: Scene, analysis: States) -> Run:
    """What the analysis of a scene finds, also in its file of columns."""
    mark = reports.fingerprint(scene)
    with recording.place(job, (analysis.table, reports.REPORT), mark) as out:
        found = analysis.find(scene, job.allow_outside)
        report: dict[str, Any] = {
            "status": "ok",
            **heading(scene),
            **sizes(found.raw, found.reduced),
            "fingerprint": mark,
            "provenance": reports.provenance(scene),
            **found.facts,
            "notices": job.notices,
        }
        if out is not None:
            with segments.room(out):
                reports.write_csv(out / analysis.table, found.columns, ["%d", *["%.15g"] * (len(found.columns) - 1)])
            report["files"] = [out / analysis.table, out / reports.REPORT]
            reports.write_report(out, report)
    rows = list(zip(*(values.tolist() for values in found.columns.values()), strict=True))
    table = Table(f"{report['scene']}: {found.title}", tuple(found.heads), rows)
    view: list[Table | str] = [table, *list_files(report)]
    return Run(about=f"{report['scene']}: {found.about}", report=report, view=view, frequencies=found.frequencies)
