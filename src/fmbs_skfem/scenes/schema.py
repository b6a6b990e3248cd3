"""The models of a scene: what may stand in a scene file, in SI units once read.

    Scene = bodies + joints + loads + damping + initial motion + analysis + outputs (+ reduction, training, compare, pictures)

Every model is frozen and refuses unknown keys. Models know their own fields only; what ties them together (names that must exist)
is checked in `consistency`.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, PrivateAttr, StrictBool, StrictStr, WithJsonSchema

from ..bodies.sections import Section
from ..core.fields import Number, Range, Time, Tolerance, word
from ..dynamics.linear import Spin
from ..reduction import hyper_reduction
from ..systems.assembly import Motion, Rayleigh
from ..systems.constraint_functions import Joint
from ..systems.loads import Load
from ..systems.probes import Probe
from . import fields, yamlfile
from .bodies import Body, Cable, PlacedPart, Plate, PointMass, Rigid, RigidPlate, Shell
from .declarations import Made, Named
from .models import Count, Model
from .parameters import SCHEMA as PARAMETER
from .surfaces import INTERPOLATIONS
from .training import Training

__all__ = [
    "Model",
    "Count",
    "Body",
    "Cable",
    "PointMass",
    "Rigid",
    "RigidPlate",
    "Plate",
    "Shell",
    "PlacedPart",
    "Initial",
    "Analysis",
    "Dynamic",
    "Static",
    "Modes",
    "Buckling",
    "HyperReduction",
    "Reduction",
    "Training",
    "Compare",
    "Pictures",
    "Scene",
    "where",
    "location",
    "json_schema",
]

VERSION = 1  #: newest schema version this release reads; 1 is the oldest


Parameter = Annotated[float, WithJsonSchema(PARAMETER)]


class Initial(Model):
    """Motion at the start; bodies not named are at rest."""

    bodies: dict[str, Annotated[Motion, Made(Motion)]] = Field(default_factory=dict)


class Dynamic(Model):
    """Time integration by generalized-alpha; every `every`-th step is kept, or states every so many seconds, span by span.

    Without `constraints`, linear ones are eliminated, except where plates are large: sparse factors need them as multipliers.
    `solver` is that of large models: this package's, or PARDISO (the extra `pardiso`).
    """

    type: Literal["dynamic"]
    constraints: Literal["eliminate", "multipliers"] | None = None
    duration: Time
    step: Time
    rho_inf: Annotated[
        Number,
        Field(ge=0.0, le=1.0, description="spectral radius at infinite frequency, from 0 (damps most) to 1 (damps nothing)"),
    ] = 0.8
    every: fields.Every = 1
    tolerance: fields.NewtonTolerance = 2e-12
    solver: Literal["own", "pardiso"] = "own"


class Static(Model):
    """Equilibrium by load steps, or by arc length along a path through limit points, its first step 1/load_steps.

    The load factor s goes from 0 to 1 and stands for t = s `time`: histories and drives are taken there. Loads without a history,
    and displacements, angles and histories that are constant, grow with s.
    """

    type: Literal["static"]
    method: Literal["load_steps", "arc_length"] = "load_steps"
    constraints: Literal["eliminate", "multipliers"] | None = None
    load_steps: Count = 10
    time: Time = 1.0
    tolerance: fields.NewtonTolerance = 1e-10


class Modes(Model):
    """Vibration modes about the equilibrium of the loads, which is found as in statics, or about the unloaded reference.

    About the reference, of the loads only springs act. `damped` modes have a damping ratio each; follower forces and
    `spin`, with which joints and loads turn, need complex modes, too. A motion that grows is named: flutter or divergence.
    """

    type: Literal["modes"]
    constraints: Literal["eliminate", "multipliers"] | None = None
    count: Count = 10
    about: Literal["equilibrium", "reference"] = "equilibrium"
    damped: StrictBool = False
    spin: Annotated[Spin, Made(Spin)] | None = None
    load_steps: Count = 10
    time: Time = 1.0
    tolerance: fields.NewtonTolerance = 1e-10


class Buckling(Model):
    """Load factors at which the loads take the stiffness away, predicted from small ones; the factor 1 stands for t = `time`."""

    type: Literal["buckling"]
    constraints: Literal["eliminate", "multipliers"] | None = None
    count: Count = 3
    time: Time = 1.0


Analysis: TypeAlias = Annotated[Dynamic | Static | Modes | Buckling, Field(discriminator="type")]


class HyperReduction(Model):
    """How elastic forces are evaluated: ECSW with relative tolerance eta over elements or points, or another way by its name."""

    tolerance: Tolerance = 1e-3
    sample: Annotated[str, word(hyper_reduction.KNOWN)] = "points"


class Reduction(Model):
    """POD of snapshots taken every `snapshots` seconds, or span by span; without `components` every body is one.

    An invariant `basis` holds with a state all its rotations: its modes are vectors and do not know the training's directions.
    """

    snapshots: fields.Snapshots
    components: Annotated[dict[str, list[StrictStr]] | None, Field(description="names, each with a list of bodies")] = None
    basis: Literal["coordinates", "invariant"] = "coordinates"
    tolerance: Tolerance = 1e-12
    modes: fields.Counts | None = None
    hyper_reduction: HyperReduction | None = HyperReduction()
    constraints: Literal["keep", "eliminate"] = "keep"


class Compare(Model):
    """Competitors in speed and error: coarser meshes (cells a body), other steps, POD tolerances, modes of FFRF."""

    coarse: list[Count] = Field(default_factory=list)
    steps: list[Time] = Field(default_factory=list)
    tolerances: list[Tolerance] = Field(default_factory=list)
    ffrf_modes: Count | None = None


class Pictures(Model):
    """Instants to draw and the field that colours the bodies."""

    instants: list[fields.Instant] = Field(default_factory=list)
    color: Literal["curvature", "strain", "velocity", "von_mises", "error"] = "curvature"


class Scene(Model):
    """A scene file, all quantities in SI units."""

    schema_version: Literal[1] = Field(alias="schema")
    name: StrictStr = ""
    description: StrictStr = ""
    units: Literal["SI"] = "SI"
    dimension: Literal[2, 3] = 3
    extensions: Annotated[list[StrictStr] | None, Field(description="a list of Python files with more types; they are run")] = None
    parameters: dict[str, Parameter] = Field(default_factory=dict)
    bodies: dict[str, Body] = Field(min_length=1)
    joints: Annotated[dict[str, Joint], Named(Joint)] = Field(default_factory=dict)
    loads: Annotated[dict[str, Load], Named(Load)] = Field(default_factory=dict)
    damping: Annotated[Rayleigh, Made(Rayleigh)] = Rayleigh()
    initial: Initial = Initial()
    analysis: Analysis
    outputs: Annotated[dict[str, Probe], Named(Probe)] = Field(default_factory=dict)
    reduction: Reduction | None = None
    training: Training | None = None
    compare: Compare | None = None
    pictures: Pictures | None = None

    _path: Path | None = PrivateAttr(default=None)
    _folder: Path = PrivateAttr(default_factory=Path)
    _node: yamlfile.Node | None = PrivateAttr(default=None)
    _ranges: dict[str, Range] = PrivateAttr(default_factory=dict)
    _changed: dict[str, float | str] = PrivateAttr(default_factory=dict)
    _used: frozenset[str] = PrivateAttr(default=frozenset())
    _repair: bool = PrivateAttr(default=False)

    @property
    def path(self) -> Path | None:
        """The file the scene was read from."""
        return self._path

    @property
    def folder(self) -> Path:
        """The folder that mesh paths are relative to."""
        return self._folder

    @property
    def repair(self) -> bool:
        """Whether nodes of meshes that are at one place are merged."""
        return self._repair

    @property
    def ranges(self) -> dict[str, Range]:
        """The parameters that have a range, in the order of the file."""
        return self._ranges

    @property
    def changed(self) -> dict[str, float | str]:
        """The parameters that were replaced when the scene was read."""
        return self._changed

    @property
    def used(self) -> frozenset[str]:
        """The parameters that some value of the scene depends on."""
        return self._used


def where(scene: Scene, *keys: str | int) -> str:
    """`file:line: key.key` of the value at a path of keys and indices of the scene, for messages."""
    return location(str(scene.path or "scene"), scene._node, keys)


def location(name: str, node: yamlfile.Node | None, keys: tuple[str | int, ...]) -> str:
    """`file:line: key.key` of a path of keys in the tree of a file."""
    path = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")
    place = name if node is None else f"{name}:{yamlfile.line(node, keys)}"
    return f"{place}: {path}" if path else place


def json_schema() -> dict[str, Any]:
    """The JSON schema of a scene file, with everything that is declared by now."""
    refresh()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scene.model_json_schema(by_alias=True)}


@functools.cache
def whole() -> dict[str, Any]:
    """The JSON schema as it is now, to look at only."""
    return json_schema()


def families() -> list[dict[str, Any]]:
    """What is declared."""
    return [dict(INTERPOLATIONS), *(dict(family.known) for family in (Joint, Load, Probe, Section))]


def refresh() -> None:
    """Let scenes take what was declared after their model was made."""
    if (now := families()) != BUILT:
        for model in (Cable, Scene):
            model.model_rebuild(force=True)
        whole.cache_clear()
        BUILT[:] = now


BUILT = families()  #: what the model of scenes takes
