"""A model that runs in a page: its module of WebAssembly, and its sliders; its film tells how
bodies follow from its unknowns.
"""

from __future__ import annotations

import base64
import zlib
from dataclasses import asdict
from typing import Any

from ..core.storage.records import dataclass
from ..core.values.display import DisplayUnits


@dataclass(frozen=True)
class PageParameter:
    """A number that a reader of the page changes."""

    name: str
    unit: str
    low: float
    high: float
    value: float


@dataclass(frozen=True)
class LiveModel:
    """A model as it runs in a page."""

    module: bytes  #: WebAssembly, see `exports.wasm`
    step: float  #: [s]
    unknowns: int
    columns: tuple[str, ...] = ()  #: of its outputs, in their order
    parameters: tuple[PageParameter, ...] = ()
    inputs: tuple[PageParameter, ...] = ()


def describe(model: LiveModel, display: DisplayUnits) -> dict[str, Any]:
    """What the page needs to run it; values in SI units, and of each the unit in which it is read,
    with its size.
    """

    def slider(one: PageParameter) -> dict[str, Any]:
        unit, size = display.find(one.unit, max(abs(one.low), abs(one.high)))
        return {**asdict(one), "unit": unit, "size": size}

    return {
        "stepSize": model.step,
        "parameters": list(map(slider, model.parameters)),
        "inputs": list(map(slider, model.inputs)),
        "unknowns": model.unknowns,
        "columns": list(model.columns),
        "module": base64.b64encode(zlib.compress(model.module, 9)).decode("ascii"),
    }
