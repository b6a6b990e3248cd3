r"""Axial force and bending moment of a cable at a place, as outputs read them.

    N = F . t,    F = int psi' dW/dr' + psi'' dW/dr'' dS,    M = EI (kappa - kappa0) at the place                              (1)

F is the force that the line beyond a place carries. psi is a step of the line's own functions, 0
before the place and 1 beyond, so that moving all that is beyond by a constant is one of the motions
for which the equations hold: F is the sum of all loads and inertia there, weighted by the step, to
the last digit on the coarsest mesh. EA times the strain at a point is not: what bends far and
hardly stretches locks on coarse meshes, and its strain, which EA multiplies, alternates within
every cell.

Two steps are taken, with their centres c = int xi psi' on either side of the place, and what is
linear between them is exact. Of a part, whose functions reach over all of it, N is EA times the
strain.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Annotated

import numpy as np
from scipy.sparse import csr_array, diags_array, hstack, vstack

from ...bodies import cable_law, laws
from ...bodies.body import Body, locate, own, unit_field
from ...core.algebra.linalg import as_csr
from ...core.errors import InputError, say
from ...core.storage.container import storable
from ...core.storage.records import dataclass
from ...core.storage.validation import Inside, Reals
from ...shapes import line
from ..places import At
from .packed import pack, unpack

NOISE = 1e-12  #: psi' and psi'' that count as zero, over the largest


@storable
@dataclass(frozen=True)
class CableSections:
    """Numbers of x places of a cable and of the p points whose stresses carry their forces."""

    law: laws.Law
    stiffness: Annotated[np.ndarray, Reals("x 2")]  #: EA [N] and EI [N m2]
    curvature: Annotated[np.ndarray, Reals("x")]  #: kappa0 [1/m]
    known: Annotated[np.ndarray, Reals("p 3")]  #: EA, EI and kappa0 of the points
    #: weight times psi' [-] of all points, then times psi'' [1/m]
    shares: Annotated[csr_array, Reals("x *")]
    #: (x, 2) Young's modulus [Pa] and the distance from the line of the farthest fibre [m]; none
    #: where they are not known
    fibres: Annotated[np.ndarray, Reals("* 2")]

    def stresses(self, N: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """N/A and |M| c/I [Pa] (s, x) of section forces (s, x), where the fibres are known."""
        E, distance = self.fibres.T
        EA, EI = self.stiffness.T
        return N * (E / EA), np.abs(M) * (E * distance / EI)

    @property
    def numbers(self) -> tuple[float, ...]:
        """All of it as the parameters of an output, the number of the law first."""
        arrays = (self.stiffness, self.curvature, self.known, self.shares, self.fibres)
        return (float(laws.number(self.law)), *pack(*arrays))

    @staticmethod
    def of(numbers: tuple[float, ...]) -> CableSections:
        """What `numbers` has made."""
        return CableSections(laws.NUMBERS[int(numbers[0])], *unpack(numbers[1:]))

    @property
    def rows(self) -> int:
        """Vectors that it reads: r' and r'' of all places, then of all points."""
        return 2 * (len(self.curvature) + len(self.known))

    def read(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """N [N] and M [N m] (s, x), r' and r'' (s, x, c) of rows u (s, (2 x + 2 p) c), see
        `sections`.

            N = F . r' / |r'|,    M = l^(2 - m) EI (kappa - kappa0)

        Without points N is that of the strain at the place.
        """
        places = len(self.curvature)
        vectors = u.reshape(len(u), self.rows, -1)
        slope, bend = np.split(vectors[:, : 2 * places], 2, axis=1)
        here = np.concatenate([slope, bend], axis=2)
        N, M = cable_law.section_forces(
            self.law.option, vectors.shape[2], tuple(self.stiffness.T), self.curvature, here
        )
        if len(self.known):
            N = np.einsum("sxc,sxc->sx", self.carried(u), slope) / np.linalg.norm(slope, axis=2)
        return N, M, slope, bend

    def carried(self, u: np.ndarray) -> np.ndarray:
        """F (s, x, c) [N] of (1), of such rows; NaN without points.

        F = sum_p w psi' dW/dr' + w psi'' dW/dr''
        """
        places = len(self.curvature)
        vectors = u.reshape(len(u), self.rows, -1)
        dim = vectors.shape[2]
        if not len(self.known):
            return np.full((len(u), places, dim), np.nan)
        there = np.concatenate(np.split(vectors[:, 2 * places :], 2, axis=1), axis=2)
        EA, EI, kappa0 = self.known.T
        S1, S2 = cable_law.stresses(self.law.option, dim, (EA, EI), kappa0, there)
        stress = np.concatenate([S1, S2], axis=1).transpose(1, 0, 2)
        F = (self.shares @ stress.reshape(len(stress), -1)).reshape(places, len(u), dim)
        return np.asarray(F.transpose(1, 0, 2))


def reads_cable(parameters: tuple[float, ...]) -> bool:
    """Whether an output reads a cable: its first parameter is the number of a law of cables."""
    return laws.NUMBERS[int(parameters[0])] in laws.CABLES


def place_of(where: str, part: Body, at: At) -> float:
    """The parameter xi of a place of a cable with a law of this package; InputError, after `where`,
    for another place.
    """
    xi = locate(part, at.place) if isinstance(part.space, line.BSpline | line.Hermite) else None
    if part.cells is None or part.cells.law not in laws.CABLES or not isinstance(xi, float | int):
        raise InputError(
            say(
                where,
                "a place of a cable with a law of this package, or a named point of a plate",
                at,
            )
        )
    return float(xi)


def sections(part: Body, xi: np.ndarray) -> tuple[csr_array, CableSections]:
    """Rows (2 x + 2 p, b) of r' and r'' by reference arc length, at places (x,) of a cable and at
    the p points of (1); their numbers.
    """
    assert part.cells is not None
    law, section = part.cells.law, part.cells.section
    shares, (e, p) = step_shares(part, xi, (0, 1), 0)
    points = line.tabulate(part.space, section.shape[1]).points
    here, there = derivatives(part, xi), derivatives(part, points[e, p])
    slope, bend = np.split(np.asarray(here @ part.reference), 2)
    kappa0 = cable_law.curvatures(law.option, part.dim, np.concatenate([slope, bend], axis=1))
    stiffness = (
        section[:2, :, cells_of(part, xi)].mean(axis=1).T
        if part.profile is None
        else part.profile.at(xi)[0][:, [0, 4], [0, 4]]
    )
    fibres = np.zeros((0, 2))
    if part.fibre_modulus:
        radius = part.radius if part.profile is None else part.profile.radii(xi)
        fibres = np.stack(np.broadcast_arrays(part.fibre_modulus, radius, xi)[:2], axis=1)
    known = section[:3, p, e].T
    numbers = CableSections(law, stiffness, kappa0, known, as_csr(hstack(shares)), fibres)
    return as_csr(vstack([here, there])), numbers


@storable
@dataclass(frozen=True)
class CableLine:
    """What a picture needs of a cable beside its line: section forces at its samples, by r' and r''
    there and at the points that carry them.
    """

    rows: Annotated[csr_array, Reals("r q")]  #: (2 p c, q) of r', then r'', at the points
    sections: Annotated[CableSections, Inside()]


def cable_line(part: Body, xi: np.ndarray, spread: Callable[[csr_array], csr_array]) -> CableLine:
    """Section forces along a cable at parameters (x,); `spread` takes rows (x, b) on its functions
    to rows (x c, q).
    """
    rows, numbers = sections(part, xi)
    return CableLine(spread(as_csr(rows[2 * len(xi) :])), numbers)


def cells_of(part: Body, xi: np.ndarray) -> np.ndarray:
    """Cells (x,) of a line at parameters (x,)."""
    breaks = line.breaks(part.space)
    return np.clip(np.searchsorted(breaks, xi, side="right") - 1, 0, len(breaks) - 2)


def step_shares(
    part: Body, xi: np.ndarray, kept: Sequence[int], slope: int
) -> tuple[list[csr_array], tuple[np.ndarray, np.ndarray]]:
    """What the points of a line have in the forces at parameters (x,): of each row `kept` of its
    table the weights times that of psi (x, p), and the cells and points (p,) that have a part.

    `slope` is the row of the table that gives psi'.
    """
    assert part.cells is not None
    weight = part.cells.section[-1].T
    near = lru_cache(maxsize=2)(partial(steps_near, part, slope=slope))  # places come in a row
    found = np.zeros((len(kept), len(xi), *weight.shape))
    for x, (at, cell) in enumerate(zip(xi, cells_of(part, xi), strict=True)):
        cells, steps, centers = near(int(cell))
        psi = np.einsum("k,kiep->iep", between(centers, float(at)), steps[:, list(kept)])
        size = np.abs(psi)
        psi[size <= NOISE * size.max(axis=(1, 2), keepdims=True)] = 0.0
        found[:, x, cells] = weight[cells] * psi
    flat = found.reshape(len(kept), len(xi), -1)
    used = np.flatnonzero(flat.any(axis=(0, 1)))
    e, p = np.divmod(used, weight.shape[1])
    return [csr_array(one[:, used]) for one in flat], (e, p)


def derivatives(part: Body, xi: np.ndarray) -> csr_array:
    """Rows (2 x, b) of r' and of r'' by reference arc length at parameters (x,) of a line, all r'
    first.
    """
    first, second = (own(part, line.sample(part.space, xi, k)) for k in (1, 2))
    r1, r2 = first @ part.reference, second @ part.reference
    J = np.linalg.norm(r1, axis=1)
    slope = diags_array(1 / J) @ first
    bend = (
        diags_array(1 / J**2) @ second - diags_array(np.einsum("xc,xc->x", r1, r2) / J**4) @ first
    )
    return csr_array(vstack([slope, bend]))


def steps_near(part: Body, cell: int, slope: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells (e,) around one; what its table has (k, 2, e, p) of steps psi between functions near
    it; their centres (k,) in xi.

    `slope` is the row of the table that gives psi'.
    """
    assert isinstance(part.space, line.BSpline | line.Hermite)
    assert part.cells is not None
    nodes = line.functions(part.space)
    one = line.fit(part.space, unit_field)[:, 0]
    order = nodes.shape[1]
    last = len(nodes) - 1
    near = np.unique(nodes[max(0, cell - order) : cell + order + 1])
    cells = np.arange(max(0, cell - 2 * order), min(last, cell + 2 * order) + 1)
    # without slope at the ends, which joints may hold
    inner = near[(near >= 2) & (near <= len(one) - 2) & (one[near] > 0.5)]
    first = inner if part.shapes is None else inner[:0]  # functions of a part move nothing alone
    shares = one[nodes[cells]] * (nodes[cells] >= first[:, None, None])
    steps = np.einsum("ipbe,keb->kiep", part.cells.table[:, :, :, cells], shares)
    weight = part.cells.section[-1][:, cells].T
    centers = np.einsum(
        "ep,kep,ep->k",
        weight,
        steps[:, slope],
        line.tabulate(part.space, weight.shape[1]).points[cells],
    )
    return cells, steps, centers


def between(centers: np.ndarray, xi: float) -> np.ndarray:
    """Weights (k,) of steps with rising centres (k,) in a value at xi: linear between the two
    around it, and beyond the ends.
    """
    weights = np.zeros(len(centers))
    if len(centers) < 2:
        return weights + 1.0
    k = int(np.clip(np.searchsorted(centers, xi), 1, len(centers) - 1))
    share = (xi - centers[k - 1]) / (centers[k] - centers[k - 1])
    weights[k - 1 : k + 1] = 1.0 - share, share
    return weights


def forces(found: CableSections, u: np.ndarray) -> list[np.ndarray]:
    """N [N] and M [N m], (s, x) each, in space with the components of M, of rows u (s, (2 x + 2 p)
    c).

    In space M is about the binormal r' x r'', zero where the line is straight.
    """
    N, M, slope, bend = found.read(u)
    if slope.shape[2] == 2:
        return [N, M]
    normal = np.cross(slope, bend)
    size = np.linalg.norm(normal, axis=2, keepdims=True)
    binormal = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0)
    return [N, M, *np.moveaxis(M[..., None] * binormal, 2, 0)]
