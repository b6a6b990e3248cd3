"""What a run found, and what people ask of it: a table, a plot, bodies to look at, files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.arguments import checked
from ...core.values.units import add_unit
from ...results import frames, mode_shapes
from ...results import motion as motions
from ...results.frames import nearest
from .. import reports
from ..result import Result, frame

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pyvista import MultiBlock

    from ...dynamics import Shapes, StateSpace, Trajectory

OUTPUTS, UNITS = "outputs.csv", "outputs.units.json"
SERIES = "motion"  #: of VTK files


def write_outputs(
    out: Path,
    times: np.ndarray,
    columns: Mapping[str, np.ndarray],
    report: Mapping[str, Any],
    heads: bool = False,
) -> list[Path]:
    """The columns (s,) over time or load factor (s,), with their SI units in their `heads`, and the
    unit of each by itself.
    """
    units = {"t": "s" if report.get("solver") else "", **report["units"]}
    named = {
        add_unit(name, units.get(name, "") if heads else ""): column
        for name, column in {"t": times, **columns}.items()
    }
    return [reports.write_csv(out / OUTPUTS, named), reports.write_json(out / UNITS, units)]


@dataclass(frozen=True, repr=False, kw_only=True)
class Run(Result):
    """A run: its outputs over time, or over the load factor of an equilibrium; of vibration modes
    their frequencies.
    """

    motion: Trajectory | None = None  #: None of vibration modes
    outputs: Mapping[str, np.ndarray] = field(default_factory=dict)  #: column -> (s,) in SI units
    frequencies: np.ndarray = field(default_factory=lambda: np.empty(0))  #: (r,) [Hz]
    shapes: Shapes | None = None  #: of vibration modes and buckling
    linear: StateSpace | None = None  #: of linear equations

    @property
    def trajectory(self) -> Trajectory:
        """All states; those that are kept of a run with `states=False`, where it lets the others
        go.
        """
        if self.motion is None:
            raise InputError(say("trajectory", "a motion or an equilibrium", "vibration modes"))
        return self.motion.states

    @property
    def times(self) -> np.ndarray:
        """(s,) [s], or load factors."""
        return self.trajectory.times if self.motion is None else self.motion.times

    def table(self) -> Any:
        """The outputs with their units, the time first: a pandas DataFrame where pandas is
        installed, else a mapping of arrays.
        """
        units = self.report.get("units", {})
        found = (
            {}
            if self.motion is None
            else {"t [s]": self.times}
            if self.report.get("solver")
            else {"load factor": self.times}
        )
        found |= {
            add_unit(name, units.get(name, "")): values for name, values in self.outputs.items()
        }
        return frame(found)

    def plot(self) -> Figure:
        """The outputs over time, transfer functions, or a Campbell diagram; InputError where there
        is nothing of that kind.
        """
        if not self.figures:
            raise InputError(
                say("plot", "a run with outputs", self.about, "draw modes with fmbs render")
            )
        return self.figures[next(iter(self.figures))]

    @checked
    def view(self, time: float | None = None) -> MultiBlock:
        """The bodies at the stored instant nearest to a time [s], the last one by default, as a
        block of pyvista for each.

        Modes are fields `mode_1`, ... of the bodies in the state about which they are.
        """
        if self.shapes is not None:
            return frames.blocks(mode_shapes.fields(self.shapes))
        if self.motion is None:
            raise InputError(say("view", "a motion, an equilibrium or modes", self.about))
        at = float(self.times[-1]) if time is None else time
        return frames.blocks(motions.frames(self.trajectory, nearest(self.trajectory.times, [at])))

    @checked
    def save(self, folder: str | Path, force: bool = False) -> list[Path]:
        """Write outputs, report and figures into a folder, and a linear system; files of another
        run are kept without `force`.
        """
        out = reports.make_folder(Path(folder))
        if (out / reports.REPORT).exists() and not force:
            remedy = "choose another folder, or force=True"
            raise InputError(say(f"save {out}", "a folder without results", reports.REPORT, remedy))
        files = [out / reports.REPORT, *self.figures.save(out)]
        if self.motion is not None:
            files += write_outputs(out, self.times, self.outputs, self.report)
        elif self.outputs:
            files.append(reports.write_csv(out / OUTPUTS, self.outputs))
        if self.linear is not None:
            files += [self.linear.save(out / name) for name in ("linear.npz", "linear.mat")]
        reports.write_report(out, {**self.report, "files": files})
        return files
