"""What all models of a scene share: they are frozen and refuse unknown keys; what is wrong stands with its path of keys."""

from __future__ import annotations

from typing import Annotated, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, StrictInt, StrictStr

from ..core.problems import Problem

Count: TypeAlias = Annotated[StrictInt, Field(ge=1, le=1_000_000)]
MeshFile: TypeAlias = Annotated[StrictStr, Field(description="a mesh file (.msh, .vtu), its path from the folder of the scene")]
BodyName: TypeAlias = Annotated[StrictStr, Field(description="a name of a body")]
Found: TypeAlias = tuple[tuple[str | int, ...], Problem]
Told: TypeAlias = tuple[tuple[str | int, ...], str]  #: path of keys and a notice


class Model(BaseModel):
    """A frozen mapping with known keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True, protected_namespaces=())
