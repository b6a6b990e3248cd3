"""Monitors: what a scene has to look at its runs, from outside of the engine: an observer of one's
own.

    monitors:
      fence: {type: leaves_box, of: tip, low: [-1 m, -1 m], high: [1 m, 1 m]}

A monitor makes an observer (`dynamics.observers`) for every run of the system, full or reduced, and
for live runs. Observers read outputs by name, which every form of the system has. Files of reduced
models keep monitors whose class is `storable`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..core.declared import Declared, require_sound
from ..dynamics.outputs import require_known
from ..systems.additions import Addition, adds
from ..systems.connections.constraint_functions import Joint
from ..systems.places import Draft


class Monitor(Declared, ABC):
    """Looks at runs: a frozen dataclass, see `core.declared`.

    Derive one with a `word` for scenes; `observer()` is called once for every run, `reads` are
    checked when the system is assembled.
    """

    name: str

    @property
    def reads(self) -> Sequence[str]:
        """Names of outputs that it reads."""
        return ()

    @abstractmethod
    def observer(self) -> Any:
        """A new `dynamics.observers.Observer`."""


@adds("monitors")
class Monitors(Addition):
    """Monitors that read outputs which there are; InputError else."""

    def __init__(self, given: Iterable[Monitor], draft: Draft) -> None:
        self.monitors = tuple(given)
        for one in self.monitors:
            require_sound("monitor", getattr(one, "name", ""), one, Monitor, draft.layout.dim)
            require_known(f"monitor '{one.name}'", draft.outputs, one.reads)

    def add(
        self, draft: Draft, joints: Sequence[Joint], numbers: Sequence[int]
    ) -> Mapping[str, Any]:
        return {"monitors": self.monitors}
