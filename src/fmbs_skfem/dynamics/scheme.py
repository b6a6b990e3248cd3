"""What a run is asked for: the method with its step, and the control of Newton's iteration.

Source: Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202, doi 10.1007/s11044-007-9084-0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from ..core import pardiso
from ..core.errors import InputError, say
from .stepping import Method

Solver: TypeAlias = Literal["own", "pardiso"]


@dataclass(frozen=True)
class GeneralizedAlpha:
    """Step h [s] and spectral radius rho_inf at infinite frequency, 0 (asymptotic annihilation) to 1 (no damping)."""

    step: float
    rho_inf: float = 0.8

    def __post_init__(self) -> None:
        if not (np.isfinite(self.step) and self.step > 0):
            raise InputError(say("analysis.step", "a positive time [s]", self.step))
        if not 0 <= self.rho_inf <= 1:
            raise InputError(say("analysis.rho_inf", "a number between 0 and 1", self.rho_inf))

    @property
    def coefficients(self) -> tuple[float, float, float, float]:
        """alpha_m, alpha_f, gamma, beta of Arnold and Bruels."""
        rho = self.rho_inf
        am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + af - am
        return am, af, gamma, (gamma + 0.5) ** 2 / 4


@dataclass(frozen=True)
class Newton:
    """Iteration control; the tolerance is relative to the norm of the reference coordinates."""

    tolerance: float = 1e-10
    iterations: int = 25
    slow: float = 0.05  #: contraction above which the iteration matrix is factored anew
    solver: Solver = "own"  #: of large models: factors or multigrid of this package, or PARDISO (the extra `pardiso`)

    def __post_init__(self) -> None:
        if self.solver not in get_args(Solver):
            raise InputError(say("newton.solver", " or ".join(get_args(Solver)), self.solver))
        if self.solver == "pardiso":
            pardiso.require()
        if not 0 < self.tolerance < 1e-2:
            raise InputError(say("newton.tolerance", "a number between 0 and 0.01", self.tolerance))


def method_of(scheme: GeneralizedAlpha, newton: Newton, h: float, scale: float) -> Method:
    am, af, gamma, beta = scheme.coefficients
    bh, gh = (1 - am) / (h**2 * beta * (1 - af)), gamma / (h * beta)
    return Method(h, am, af, gamma, beta, bh, gh, h**2 * beta, newton.tolerance * scale, newton.iterations, newton.slow)
