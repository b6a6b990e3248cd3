"""The figure of a run: a panel for the columns of an output that are of one unit, such as the
components of a vector.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ...core.values.display import SI, DisplayUnits
from ...core.values.units import add_unit
from ...results.colour_scales import SILENT
from ...results.plots import PANELS, Panel, panel_grid
from ...systems.measures import probes
from .. import kinds
from ..result import Figures
from .outcome import OUTPUTS

if TYPE_CHECKING:
    from ...systems.system import Output

FLAT = 0.02  #: of the largest range of a panel; a curve that moves less, but moves, has a panel of its own
TOGETHER = 6  #: most curves of a panel
ROUND = 1e-9  #: of the largest reaction of a model; one that stays below is round-off of forces that balance each other
POWERS = {"N": 0, "N m": 1, "N/m": -1}  #: of a length in the units of reactions, beside a force


def figures_of(
    outputs: Mapping[str, Output],
    times: np.ndarray,
    columns: Mapping[str, np.ndarray],
    title: str = "",
    across: str = "time [s]",
    marks: Sequence[tuple[float, str]] = (),
    silent: Collection[str] = (),
    errors: Mapping[str, float] = MappingProxyType({}),
    display: DisplayUnits = SI,
) -> Figures:
    """The columns (s,) of `outputs` that are finite over `times` (s,), in at most PANELS panels,
    with marks and bands of errors.

    Columns that are `silent`, see `find_noise`, are drawn as zero. There is no figure of a single
    instant.
    """
    finite = {name: values for name, values in columns.items() if np.isfinite(values).all()}
    if len(times) < 2 or not finite:
        return Figures()
    found = arrange(outputs, finite, silent, errors)
    shown = sum(len(panel.curves) for panel in found)
    left = (
        f" ({shown} of {len(finite)} columns, the others are in {OUTPUTS})"
        if shown < len(finite)
        else ""
    )
    return Figures(
        {
            "outputs": partial(
                panel_grid,
                times,
                found,
                title=title + left,
                across=across,
                marks=marks,
                display=display,
            )
        }
    )


def find_noise(
    outputs: Mapping[str, Output], known: Mapping[str, np.ndarray], size: float, noise: float
) -> frozenset[str]:
    """Known columns (s,) of reactions that are round-off: below ROUND of the largest one, or within
    `noise` [N].

    Moments and forces per length are compared with forces by the `size` of the mechanism [m], so
    that no unit counts.
    """
    units = probes.column_units(outputs)
    balancing = [one for one in outputs.values() if probes.kind_of(one).balances]
    reactions = [
        column
        for one in balancing
        for column in one.columns
        if column in known and np.isfinite(known[column]).all()
    ]
    forces = {
        column: float(np.abs(known[column]).max()) / size ** POWERS[units[column]]
        for column in reactions
        if units[column] in POWERS
    }
    limit = max(noise, ROUND * max(forces.values(), default=0.0))
    return frozenset(column for column, force in forces.items() if 0.0 < force <= limit)


def arrange(
    outputs: Mapping[str, Output],
    known: Mapping[str, np.ndarray],
    noise: Collection[str] = (),
    errors: Mapping[str, float] = MappingProxyType({}),
) -> list[Panel]:
    """Panels of the known columns (s,), in the order of the outputs: at most PANELS, the first ones
    of every output.

    Columns of `noise` are drawn as zero, and say so.
    """
    known = {
        column: np.zeros_like(values) if column in noise else values
        for column, values in known.items()
    }
    units = probes.column_units(outputs)
    labels = probes.column_labels(outputs)
    found: list[tuple[int, Panel]] = []
    for name, output in outputs.items():
        groups: dict[tuple[object, ...], dict[str, np.ndarray]] = {}
        columns = [column for column in output.columns if column in known]
        for column in columns:
            alike = [known[other] for other in columns if units[other] == units[column]]
            span = np.ptp(known[column])
            largest = max(np.ptp(values) for values in alike)
            key = (
                (units[column], column)
                if 0.0 < span < FLAT * largest
                else (units[column], len(alike) > TOGETHER and column)
            )
            groups.setdefault(key, {})[column] = known[column]
        for rank, ((unit, *_), group) in enumerate(groups.items()):
            alone = kinds.heading(units, labels, next(iter(group)))
            title = alone if len(group) == 1 else add_unit(name, str(unit))
            names = {
                column: labels.get(column, column.removeprefix(f"{name}_")) for column in group
            }
            names = (
                names
                if len(set(names.values())) == len(names)
                else {column: column for column in group}
            )
            silent = group.keys() <= set(noise)
            named = {one: names[one] + SILENT * (one in noise and not silent) for one in group}
            bands = {named[one]: errors[one] for one in group if one in errors and one not in noise}
            curves = {named[one]: group[one] for one in group}
            columns_of = {named[one]: one for one in group}
            found.append((rank, Panel(title + SILENT * silent, curves, bands, columns_of)))
    last = sorted(rank for rank, _ in found)[:PANELS][-1]
    first = [panel for rank, panel in found if rank < last]
    room = iter(range(PANELS - len(first)))
    return [
        panel
        for rank, panel in found
        if rank < last or (rank == last and next(room, None) is not None)
    ]
