"""What may stand in a scene file, in SI units once read.

    Scene = bodies + joints + loads + damping + initial motion + analysis + outputs (+ reduction, training, compare, pictures)

Every section is a dataclass or a family, declared once (`mappings`), and knows its own fields only;
what ties them together (names that must exist) is checked in `consistency`. Bodies and analyses of
the package are imported here, which makes them known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from ..control.controllers import Controller
from ..control.events import Event
from ..control.monitors import Monitor
from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values import mappings
from ..core.values.display import DisplayUnits, typed_in
from ..core.values.fields import Count, Takes, Time, Tolerance, word
from ..core.values.inputs import Input
from ..core.values.mappings import HIDDEN, names
from ..core.values.ranges import Parameter
from ..reduction.hyper import hyper_reduction
from ..reduction.training_signals import TrainingSignals
from ..systems.assembly import Motion, Rayleigh
from ..systems.connections.constraint_functions import Joint
from ..systems.forces.loads import Load
from ..systems.measures.probes import Probe
from . import field_kinds as fields
from . import yamlfile
from .analyses.analysis import Analysis
from .analyses.buckling import Buckling
from .analyses.campbell import Campbell
from .analyses.dynamic import Dynamic
from .analyses.inverse_dynamics import InverseDynamics
from .analyses.linearisation import Linearise
from .analyses.static import Static
from .analyses.vibration import Modes
from .bodies import Cable, PlacedPart, Plate, PointMass, Rigid, RigidPlate, SceneBody, Shell
from .inputs import INPUT, TABLE, TableModel
from .matrices import MatricesBody
from .parameters import SCHEMA, Changes
from .solids import SolidBody
from .training_options import Training

__all__ = [
    "SceneBody",
    "Cable",
    "PointMass",
    "Rigid",
    "RigidPlate",
    "MatricesBody",
    "SolidBody",
    "Plate",
    "Shell",
    "PlacedPart",
    "Initial",
    "Analysis",
    "Dynamic",
    "InverseDynamics",
    "Static",
    "Modes",
    "Buckling",
    "Campbell",
    "Linearise",
    "HyperReductionChoice",
    "Reduction",
    "Training",
    "Compare",
    "Pictures",
    "Scene",
    "json_schema",
]

VERSION = 1  #: newest schema version this release reads; 1 is the oldest
PARAMETER = Takes(lambda value, context: value, SCHEMA)  #: one that has been resolved


@dataclass(frozen=True)
class Initial:
    """Motion at the start; bodies not named are at rest."""

    bodies: dict[str, Motion] = field(default_factory=dict)


@dataclass(frozen=True)
class HyperReductionChoice:
    """How elastic forces are evaluated: ECSW with relative tolerance eta over elements or points,
    or another way by its name.

    Without a `tolerance` `fmbs reduce` finds it for the accuracy of the analysis; without an
    accuracy it is 1e-3.
    """

    tolerance: Tolerance | None = None
    sample: Annotated[str, word(hyper_reduction.KNOWN)] = "points"


@dataclass(frozen=True)
class Reduction:
    """POD of snapshots taken every `snapshots` seconds, or span by span; without `components` every
    body is one.

    An invariant `basis` holds with a state all its rotations: its modes are vectors and do not know
    the training's directions. Without `tolerance` and `modes` `fmbs reduce` finds eps for the
    accuracy of the analysis; without an accuracy it is 1e-12.
    """

    snapshots: fields.Snapshots
    components: Annotated[dict[str, list[str]] | None, "names, each with a list of bodies"] = None
    basis: Literal["coordinates", "invariant"] = "coordinates"
    tolerance: Tolerance | None = None
    modes: fields.Counts | None = None
    hyper_reduction: HyperReductionChoice | None = field(default_factory=HyperReductionChoice)
    constraints: Literal["keep", "eliminate"] = "keep"
    signals: Annotated[TrainingSignals, "of inputs that have ranges"] = field(
        default_factory=TrainingSignals
    )


@dataclass(frozen=True)
class Compare:
    """Competitors in speed and error: coarser meshes (cells a body), other steps, POD tolerances,
    modes of FFRF.
    """

    coarse: list[Count] = field(default_factory=list)
    steps: list[Time] = field(default_factory=list)
    tolerances: list[Tolerance] = field(default_factory=list)
    ffrf_modes: Count | None = None


@dataclass(frozen=True)
class Pictures:
    """Instants to draw and the field that colours the bodies."""

    instants: list[fields.Instant] = field(default_factory=list)
    color: Literal[
        "curvature",
        "strain",
        "velocity",
        "axial_force",
        "shear_force",
        "bending_moment",
        "torque",
        "torsion",
        "normal_stress",
        "von_mises",
        "von_mises_recovered",
        "error",
    ] = "curvature"


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A scene file, all quantities in SI units."""

    schema: Literal[1]
    name: str = ""
    description: str = ""
    units: Literal["SI"] = "SI"
    display_units: fields.DisplayUnits = ()
    dimension: Literal[2, 3] = 3
    extensions: Annotated[
        list[str] | None, "a list of Python files with more types; they are run"
    ] = None
    parameters: dict[str, Annotated[float, PARAMETER]] = field(default_factory=dict)
    inputs: dict[str, Annotated[Input, INPUT]] = field(default_factory=dict)
    tables: dict[str, Annotated[TableModel, TABLE]] = field(default_factory=dict)
    bodies: Annotated[dict[str, SceneBody], names(SceneBody, 1)]
    joints: dict[str, Joint] = field(default_factory=dict)
    loads: dict[str, Load] = field(default_factory=dict)
    controllers: dict[str, Controller] = field(default_factory=dict)
    events: Annotated[dict[str, Event], names(Event, words=True)] = field(default_factory=dict)
    monitors: dict[str, Monitor] = field(default_factory=dict)
    damping: Rayleigh = field(default_factory=Rayleigh)
    initial: Initial = field(default_factory=Initial)
    analysis: Annotated[
        Analysis, "what to compute, such as {type: dynamic, duration: 1 s, step: 1 ms}"
    ]
    outputs: dict[str, Probe] = field(default_factory=dict)
    reduction: Reduction | None = None
    training: Training | None = None
    compare: Compare | None = None
    pictures: Pictures | None = None
    #: the file it was read from, the folder that paths of its files are relative to, and the tree
    #: of the file
    path: Path | None = field(default=None, metadata=HIDDEN)
    folder: Path = field(default=Path(), metadata=HIDDEN)
    node: yamlfile.Node | None = field(default=None, metadata=HIDDEN, repr=False)
    #: parameters that have a range, in the order of the file, that were replaced when it was read,
    #: and that some value depends on
    ranges: dict[str, Parameter] = field(default_factory=dict, metadata=HIDDEN)
    parameter_units: dict[str, str] = field(default_factory=dict, metadata=HIDDEN)  #: SI units
    changed: dict[str, float | str] = field(default_factory=dict, metadata=HIDDEN)
    used: frozenset[str] = field(default=frozenset(), metadata=HIDDEN)
    #: whether nodes of meshes that are at one place are merged
    repair: bool = field(default=False, metadata=HIDDEN)
    #: for other values
    read: Callable[[Changes], Scene] | None = field(
        default=None, metadata=HIDDEN, repr=False, compare=False
    )
    #: what was found for an accuracy, as `chosen` takes it
    choice: tuple[Any, ...] | None = field(default=None, metadata=HIDDEN)

    @cached_property
    def display(self) -> DisplayUnits:
        """The units in which its results are read, see `core.values.display`."""
        return DisplayUnits(
            self.display_units,
            () if self.node is None else tuple(dict.fromkeys(typed_in(yamlfile.plain(self.node)))),
        )

    def again(self, changed: Changes) -> Scene:
        """The same scene with other values of parameters, on top of those it was read with;
        warnings are not repeated.
        """
        if self.read is None:
            raise InputError(
                say("scene", "one that was read from a file or a text", "one made in Python")
            )
        found = self.read({**self.changed, **changed})
        return found if self.choice is None else found.chosen(*self.choice)

    def chosen(
        self,
        cells: int | None,
        step: float | None,
        local_error: float = 0.0,
        tolerance: float | None = None,
    ) -> Scene:
        """The scene with these cells in all lines that have none, and a step [s], as far as they
        are given; without an accuracy.

        With a `local_error` steps are divided that err by more, see `dynamics.GeneralizedAlpha`;
        the `tolerance` is Newton's.
        """
        from . import build

        found = build.history(self).settled(step, local_error, tolerance)
        bodies = {
            name: body.with_cells(cells) if cells and body.open else body
            for name, body in self.bodies.items()
        }
        return replace(
            self, bodies=bodies, analysis=found, choice=(cells, step, local_error, tolerance)
        )

    def run(self, **options: Any) -> Any:
        """`studies.run` of this scene, with its options: a `studies.Run`."""
        import fmbs_skfem  # through the front door: studies stand above scenes

        return fmbs_skfem.studies.run(self, **options)


def json_schema() -> dict[str, Any]:
    """The JSON schema of a scene file, with everything that is declared by now."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **mappings.json_schema(Scene),
    }
