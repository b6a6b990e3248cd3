"""What the training of a reduced part showed beyond its shape functions, by which a run sees what
the part cannot do.

    F = [S, T],   T^T W S = 0,   T^T W T = 1

S are the shape functions of the part, T the next ones of its training, W is the mass over that of
the body.
"""

from __future__ import annotations

from dataclasses import field
from typing import Annotated

import numpy as np

from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.storage.validation import Indices, Number, Reals


def nothing() -> np.ndarray:
    """No shapes."""
    return np.zeros((0, 0))


@storable
@dataclass(frozen=True)
class MissingShapes:
    """The functions F (f) of a part at all quadrature points (g) of its body, with its shape
    functions S (b).

        F = [S, T],    T^T W T = 1,    S^T W T = 0

    T are the next functions of its training, orthonormal in the mass over that of the body and
    orthogonal to S.
    """

    #: derivatives of F that the law reads [1/m, 1/m2]
    functions: Annotated[np.ndarray, Reals("k g f")]
    positions: Annotated[np.ndarray, Reals("g c")]  #: of the points in the reference [m]
    #: rows of the law, the last one the weight of a point
    section: Annotated[np.ndarray, Reals("i 1 g")]
    mass: Annotated[np.ndarray, Reals("f b")]  #: F^T M S over the mass of the body
    metric: Annotated[np.ndarray, Reals("f f")]  #: F^T W F
    rows: Annotated[np.ndarray, Reals("j f")]  #: positions, slopes and axes at places
    place: Annotated[np.ndarray, Indices("j")]  #: number of the place of every row
    #: largest root mean square of what S leaves out of a state of the training [m]
    left_out: Annotated[float, Number(0.0)]
    #: numbers of places with directions on which no moment acted in the training; none where its
    #: record does not say
    unbent: Annotated[np.ndarray, Indices("*")] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    #: (w, t) T as of `body.over_space`
    over_space: Annotated[np.ndarray, Reals("* *")] = field(default_factory=nothing)
    #: (t, t) T^T M T over the mass of the body
    inertia: Annotated[np.ndarray, Reals("* *")] = field(default_factory=nothing)
    #: (i, t) T of the functions that frames count
    axes: Annotated[np.ndarray, Reals("* *")] = field(default_factory=nothing)
