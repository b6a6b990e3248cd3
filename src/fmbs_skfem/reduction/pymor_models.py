r"""Systems as models of pyMOR, whose reductors run on them, and bases of either side for the other;
needs the extra `pymor`.

    statics     f(x0 + u, t) = 0                   a StationaryModel in displacements u (n,), its parameter t the time of histories
    transfer    z' = A z + B w,  y = C z + D w     an LTIModel about an equilibrium, see `dynamics.state_space`
    reduced     x = x0 + V z                       the system in a basis of pyMOR: a System that `dynamics.integrate` moves

Source: R. Milk, S. Rave, F. Schindler, pyMOR - Generic algorithms and interfaces for model order
reduction, SIAM J. Sci. Comput. 38 (2016) S194-S216, doi:10.1137/15M1026614.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csc_array, csr_array

from ..core import extras
from ..core.errors import InputError, say
from ..dynamics.near_state.statespace import StateSpace
from ..systems import operators
from ..systems.system import System, change_coordinates
from .spaces import pod

extras.need("pymor", "fmbs_skfem.reduction.pymor_models")

from pymor.models.basic import StationaryModel  # noqa: E402  (after what says how to install it)
from pymor.models.iosys import LTIModel  # noqa: E402
from pymor.operators.constructions import ZeroOperator  # noqa: E402
from pymor.operators.interface import Operator  # noqa: E402
from pymor.operators.numpy import NumpyMatrixOperator  # noqa: E402
from pymor.vectorarrays.numpy import NumpyVectorSpace  # noqa: E402


class ForceOperator(Operator):
    """Forces of a system as an operator of pyMOR.

        u -> f(x0 + u, t)

    Elastic forces minus loads [N] of displacements from the reference.
    """

    linear = False

    def __init__(self, system: System) -> None:
        self.system = system
        self.name = "force"
        self.source = self.range = NumpyVectorSpace(system.size)
        self.parameters_own = {"t": 1}

    def apply(self, U: Any, mu: Any = None) -> Any:
        x = U.to_numpy().T + self.system.x0
        return self.range.from_numpy(
            np.stack([operators.force(self.system, one, t=time_in(mu)) for one in x], axis=1)
        )

    def jacobian(self, U: Any, mu: Any = None) -> Any:
        x = U.to_numpy().ravel() + self.system.x0
        return NumpyMatrixOperator(operators.tangent(self.system, x, t=time_in(mu)).tocsc())


def time_in(mu: Any) -> float:
    """The time of histories in a parameter of pyMOR; 0 without one."""
    return float(np.ravel(mu["t"])[0]) if mu else 0.0


def statics(system: System) -> StationaryModel:
    """The equilibria of a system without multipliers, `systems.eliminate`, with the mass as the
    product "mass".

    InputError where multipliers are left: they would be unknowns beside the displacements.
    """
    if system.constraints.names:
        got = f"{len(system.constraints.names)} of them"
        raise InputError(
            say(
                "pymor_models.statics",
                "a system without multipliers",
                got,
                "linear joints alone are eliminated",
            )
        )
    force = ForceOperator(system)
    mass = NumpyMatrixOperator(csc_array(system.mass), name="mass")
    return StationaryModel(
        force,
        ZeroOperator(force.range, NumpyVectorSpace(1)),
        products={"mass": mass},
        name="fmbs statics",
    )


def transfer(space: StateSpace) -> LTIModel:
    """The linear system of `dynamics.state_space`, from named inputs to named outputs."""
    return LTIModel.from_matrices(space.A, space.B, space.C, space.D, name="fmbs")


def reduced(system: System, basis: Any) -> System:
    """The system in unknowns z (r,), with the vectors of a VectorArray of pyMOR, made orthonormal,
    as columns of V (n, r).

        x = x0 + V z

    InputError for vectors of another length.
    """
    V = columns(basis)
    if len(V) != system.size:
        raise InputError(say("pymor_models.reduced", f"vectors of {system.size} numbers", len(V)))
    return change_coordinates(system, np.linalg.qr(V)[0], system.x0)


def basis(
    vectors: Any, tolerance: float | None = None, modes: int | None = None, product: Any = None
) -> Any:
    """POD of this package of a VectorArray of pyMOR about zero, as a VectorArray:
    `reduction.spaces.pod`, eps or a number of modes.

    `product`, an operator of pyMOR with a matrix, is the metric; Euclid's without one.
    """
    X = columns(vectors)
    metric = None if product is None else csr_array(product.matrix)
    found = pod.basis(X, tolerance, modes, mean=np.zeros(len(X)), metric=metric)
    return vectors.space.from_numpy(found.modes)


def columns(vectors: Any) -> np.ndarray:
    """The vectors of a VectorArray as columns (n, s)."""
    return np.asarray(vectors.to_numpy())
