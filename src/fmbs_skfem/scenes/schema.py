"""The models of a scene: what may stand in a scene file, in SI units once read.

    Scene = bodies + joints + loads + damping + initial motion + analysis + outputs (+ reduction, compare, pictures)

Every model is frozen and refuses unknown keys. Models know their own fields only; what ties them together (names that must exist)
is checked in `consistency`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, StrictInt, StrictStr

from . import fields, yamlfile

VERSION = 1  #: newest schema version this release reads; 1 is the oldest

Count: TypeAlias = Annotated[StrictInt, Field(ge=1, le=1_000_000)]


class Model(BaseModel):
    """A frozen mapping with known keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True, protected_namespaces=())


class Circular(Model):
    """Solid circular section."""

    shape: Literal["circular"]
    diameter: fields.Length


class Rectangular(Model):
    """Solid rectangular section, `height` in the plane of bending."""

    shape: Literal["rectangular"]
    width: fields.Length
    height: fields.Length


class Given(Model):
    """Stiffnesses and mass per length given directly."""

    shape: Literal["given"]
    EA: fields.AxialStiffness
    EI: fields.BendingStiffness
    rhoA: fields.LineDensity


class Material(Model):
    """Linear elastic material."""

    young_modulus: fields.Pressure
    density: fields.Density


class Cable(Model):
    """A thin cable or beam along a line of a mesh file; `refine` splits every mesh cell into that many."""

    type: Literal["cable"]
    mesh: StrictStr
    line: StrictStr | None = None
    interpolation: Literal["bspline", "ancf"] = "bspline"
    degree: Annotated[StrictInt, Field(ge=2, le=9)] = 3
    continuity: Annotated[StrictInt, Field(ge=1, le=8)] = 1
    section: Annotated[Circular | Rectangular | Given, Field(discriminator="shape")]
    material: Material | None = None
    curvature: Literal["exact", "material", "quadratic"] = "exact"
    origin: fields.Position | None = None
    rotation: fields.Rotation | None = None
    refine: Annotated[StrictInt, Field(ge=1, le=1000)] = 1


class PointMass(Model):
    """A mass point."""

    type: Literal["point_mass"]
    mass: fields.Mass
    position: fields.Position


Body: TypeAlias = Annotated[Cable | PointMass, Field(discriminator="type")]


class Pin(Model):
    """Two points coincide; `spherical` is the word in space. Without `to` the point stays where it is."""

    type: Literal["pin", "spherical"]
    at: fields.At
    to: fields.To = None


class Clamp(Model):
    """Position and slope direction fixed."""

    type: Literal["clamp"]
    at: fields.At


class Weld(Model):
    """Position and slope of two bodies tied together."""

    type: Literal["weld"]
    at: fields.At
    to: fields.At


class DrivenAngle(Model):
    """The slope turns by angle(t) [rad] from its reference direction, about z in the plane, about `axis` in space."""

    type: Literal["driven_angle"]
    at: fields.At
    angle: fields.Angle
    axis: fields.Direction | None = None


class DrivenPosition(Model):
    """A point is displaced from its reference position by functions of t [m]."""

    type: Literal["driven_position"]
    at: fields.At
    displacement: fields.Motion


class Distance(Model):
    """A massless rigid link; its length is that of the reference unless given."""

    type: Literal["distance"]
    at: fields.At
    to: fields.To
    length: fields.Length | None = None


class Slider(Model):
    """A point stays on a line through its reference position."""

    type: Literal["slider"]
    at: fields.At
    direction: fields.Direction


Joint: TypeAlias = Annotated[Pin | Clamp | Weld | DrivenAngle | DrivenPosition | Distance | Slider, Field(discriminator="type")]


class Gravity(Model):
    """Uniform acceleration of all bodies."""

    type: Literal["gravity"]
    acceleration: fields.Acceleration


class PointForce(Model):
    """A force of fixed direction at a point, times `history`."""

    type: Literal["point_force"]
    at: fields.At
    force: fields.Force
    history: fields.History | None = None


class Follower(Model):
    """A force that turns with the slope: [tangential, normal] in the plane, tangential in space."""

    type: Literal["follower"]
    at: fields.At
    force: fields.FollowerForce
    history: fields.History | None = None


class Moment(Model):
    """A moment: about z in the plane, a vector in space."""

    type: Literal["moment"]
    at: fields.At
    moment: fields.Moment
    history: fields.History | None = None


Load: TypeAlias = Annotated[Gravity | PointForce | Follower | Moment, Field(discriminator="type")]


class Damping(Model):
    """Rayleigh damping: mass-proportional [1/s] and stiffness-proportional [s]."""

    mass: fields.Rate = 0.0
    stiffness: fields.Delay = 0.0


class Motion(Model):
    """Rigid velocity field of a body at the start, v = velocity + angular_velocity x r."""

    velocity: fields.Velocity | None = None
    angular_velocity: fields.AngularVelocity | None = None


class Initial(Model):
    """Motion at the start; bodies not named are at rest."""

    bodies: dict[str, Motion] = {}


class Dynamic(Model):
    """Time integration by generalized-alpha; every `every`-th step is kept."""

    type: Literal["dynamic"]
    constraints: Literal["eliminate", "multipliers"] = "eliminate"
    duration: fields.Time
    step: fields.Time
    rho_inf: Annotated[fields.Number, Field(ge=0.0, le=1.0)] = 0.8
    every: Count = 1
    tolerance: fields.Tolerance = 1e-10


class Static(Model):
    """Equilibrium by load stepping."""

    type: Literal["static"]
    constraints: Literal["eliminate", "multipliers"] = "eliminate"
    load_steps: Count = 10
    tolerance: fields.Tolerance = 1e-10


class Modes(Model):
    """Vibration modes about the reference configuration."""

    type: Literal["modes"]
    constraints: Literal["eliminate", "multipliers"] = "eliminate"
    count: Count = 10


Analysis: TypeAlias = Annotated[Dynamic | Static | Modes, Field(discriminator="type")]


class PointOutput(Model):
    """Position, velocity or slope of a point, one column a coordinate."""

    type: Literal["position", "velocity", "slope"]
    at: fields.At


class DeflectionOutput(Model):
    """Position of the tip normal to the root's slope."""

    type: Literal["deflection"]
    tip: fields.At
    root: fields.At


class EnergyOutput(Model):
    """Kinetic, strain and potential energy and their balance."""

    type: Literal["energy"]


class ReactionOutput(Model):
    """Force of a joint."""

    type: Literal["reaction"]
    joint: StrictStr


Output: TypeAlias = Annotated[PointOutput | DeflectionOutput | EnergyOutput | ReactionOutput, Field(discriminator="type")]


class HyperReduction(Model):
    """ECSW with relative tolerance eta, on elements or on quadrature points."""

    tolerance: fields.Tolerance = 1e-3
    sample: Literal["elements", "points"] = "points"


class Reduction(Model):
    """POD of snapshots taken every `snapshots` seconds; without `components` every body is one."""

    snapshots: fields.Time
    components: dict[str, list[StrictStr]] | None = None
    tolerance: fields.Tolerance = 1e-12
    modes: fields.Counts | None = None
    hyper_reduction: HyperReduction | None = HyperReduction()
    constraints: Literal["keep", "eliminate"] = "keep"


class Compare(Model):
    """Competitors in speed and error: coarser meshes (cells a body), other steps, POD tolerances, modes of FFRF."""

    coarse: list[Count] = []
    steps: list[fields.Time] = []
    tolerances: list[fields.Tolerance] = []
    ffrf_modes: Count | None = None


class Pictures(Model):
    """Instants to draw and the field that colours the bodies."""

    instants: list[fields.Instant] = []
    color: Literal["curvature", "strain", "velocity", "error"] = "curvature"


class Scene(Model):
    """A scene file, all quantities in SI units."""

    schema_version: Literal[1] = Field(alias="schema")
    name: StrictStr = ""
    description: StrictStr = ""
    units: Literal["SI"] = "SI"
    dimension: Literal[2, 3] = 3
    parameters: dict[str, fields.Number] = {}
    bodies: dict[str, Body] = Field(min_length=1)
    joints: dict[str, Joint] = {}
    loads: dict[str, Load] = {}
    damping: Damping = Damping()
    initial: Initial = Initial()
    analysis: Analysis
    outputs: dict[str, Output] = {}
    reduction: Reduction | None = None
    compare: Compare | None = None
    pictures: Pictures | None = None

    _path: Path | None = PrivateAttr(default=None)
    _folder: Path = PrivateAttr(default_factory=Path)
    _node: yamlfile.Node | None = PrivateAttr(default=None)

    @property
    def path(self) -> Path | None:
        """The file the scene was read from."""
        return self._path

    @property
    def folder(self) -> Path:
        """The folder that mesh paths are relative to."""
        return self._folder


def where(scene: Scene, *keys: str | int) -> str:
    """`file:line: key.key` of a value of the scene, for messages."""
    return location(str(scene.path or "scene"), scene._node, keys)


def location(name: str, node: yamlfile.Node | None, keys: tuple[str | int, ...]) -> str:
    """`file:line: key.key` of a path of keys in the tree of a file."""
    path = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(".")
    place = name if node is None else f"{name}:{yamlfile.line(node, keys)}"
    return f"{place}: {path}" if path else place


def json_schema() -> dict[str, Any]:
    """The JSON schema of a scene file."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scene.model_json_schema(by_alias=True)}
