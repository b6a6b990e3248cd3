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

import numpy as np
from scipy.sparse import csr_array, diags_array, vstack

from ...bodies import cable_law, laws
from ...bodies.body import Body, locate, own, unit_field
from ...core.errors import InputError, say
from ...shapes import line
from ..places import At

HEAD = 4  #: parameters of the place: law, EA [N], EI [N m2], kappa0 [1/m]
EACH = 5  #: and of every quadrature point: EA [N], EI [N m2], kappa0 [1/m], weight times psi' [-] and psi'' [1/m]
NOISE = 1e-12  #: psi' and psi'' that count as zero, over the largest


def reads_cable(parameters: tuple[float, ...]) -> bool:
    """Whether an output reads a cable: its first parameter is the number of a law of cables."""
    return laws.NUMBERS[int(parameters[0])] in laws.CABLES


def counts(parameters: tuple[float, ...], dim: int) -> tuple[int, int]:
    """How many rows and parameters the output of a cable has in a file.

    With p points 2 (1 + p) c rows and 4 + 5 p parameters; `dim` is c.
    """
    points = max(0, len(parameters) - HEAD) // EACH
    return 2 * dim * (1 + points), HEAD + EACH * points


def cable_point(where: str, part: Body, at: At) -> tuple[csr_array, tuple[float, ...]]:
    """Rows (2 + 2 p, b) of r' and r'' by reference arc length, at a place of a cable and at the p
    points of (1); its parameters.

    Parameters are the law, EA [N], EI [N m2] and kappa0 [1/m] of the place, and five numbers a
    point, see `EACH`. InputError, after `where`, where `at` is no place of a cable with a law of
    this package.
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
    law, section = part.cells.law, part.cells.section
    breaks = line.breaks(part.space)
    cell = int(np.clip(np.searchsorted(breaks, xi, side="right") - 1, 0, section.shape[2] - 1))
    cells, steps, centers = steps_near(part, cell)
    weights = between(centers, float(xi))
    psi = np.einsum("k,kiep->iep", weights, steps)
    size = np.abs(psi)
    e, p = np.nonzero((size > NOISE * size.max(axis=(1, 2), keepdims=True)).any(axis=0))
    points = line.tabulate(part.space, section.shape[1]).points[cells]
    here, there = derivatives(part, np.array([float(xi)])), derivatives(part, points[e, p])
    kappa0 = cable_law.curvatures(law.option, part.dim, (here @ part.reference).reshape(1, -1))
    EA, EI = (
        section[:2, :, cell].mean(axis=1)
        if part.profile is None
        else part.profile.at(np.array([xi]))[0][0, [0, 4], [0, 4]]
    )
    known = section[:, p, cells[e]]
    each = np.column_stack([*known[:3], known[3] * psi[0, e, p], known[3] * psi[1, e, p]])
    parameters = (
        float(laws.number(law)),
        float(EA),
        float(EI),
        float(kappa0[0]),
        *(float(value) for value in each.ravel()),
    )
    return csr_array(vstack([here, there])), parameters


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


def cable_forces(parameters: tuple[float, ...], dim: int, u: np.ndarray) -> list[np.ndarray]:
    """N [N] and M [N m], (s,) each, in space with the components of M, of rows u (s, (2 + 2 p) c)
    that `cable_point` gives.

        N = F . r' / |r'|,    F = sum_p w psi' dW/dr' + w psi'' dW/dr'',    M = l^(2 - m) EI (kappa - kappa0)

    In space M is about the binormal r' x r'', zero where the line is straight. Without points N is
    that of the strain at the place.
    """
    number, EA, EI, kappa0 = parameters[:HEAD]
    slope, bend = u[:, :dim], u[:, dim : 2 * dim]
    n = laws.NUMBERS[int(number)].option
    N, M = cable_law.section_forces(n, dim, (EA, EI), kappa0, u[:, : 2 * dim])
    if len(parameters) > HEAD:
        force = carried(parameters, dim, u)
        N = np.einsum("sc,sc->s", force, slope) / np.linalg.norm(slope, axis=1)
    if dim == 2:
        return [N, M]
    normal = np.cross(slope, bend)
    size = np.linalg.norm(normal, axis=1)
    binormal = np.divide(
        normal, size[:, None], out=np.zeros_like(normal), where=size[:, None] > 0.0
    )
    return [N, M, *(M[:, None] * binormal).T]


def carried(parameters: tuple[float, ...], dim: int, u: np.ndarray) -> np.ndarray:
    """F (s, c) [N] of (1) that the line beyond a place carries, of rows as those of `cable_forces`;
    NaN without points.
    """
    if len(parameters) == HEAD:
        return np.full((len(u), dim), np.nan)
    n = laws.NUMBERS[int(parameters[0])].option
    EAs, EIs, kappas, first, second = np.reshape(parameters[HEAD:], (-1, EACH)).T
    gradients = np.concatenate(
        np.split(u[:, 2 * dim :].reshape(len(u), -1, dim), 2, axis=1), axis=2
    )
    S1, S2 = cable_law.stresses(n, dim, (EAs, EIs), kappas, gradients)
    return np.asarray(np.einsum("p,spc->sc", first, S1) + np.einsum("p,spc->sc", second, S2))
