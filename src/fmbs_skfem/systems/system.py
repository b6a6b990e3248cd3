r"""System: the equations of motion as arrays.

    M q'' + C q' + K q + sum_j L_j^T phi_j(L_j q) - Q(q, t) + Phi_q^T lambda = 0,     Phi(q, t) = 0               (2)

All laws act on linear images of the unknowns: strain energy on gradients, joints and loads on probe
rows y = P x + y0. A change of coordinates x = V z + d therefore changes arrays only; elimination of
constraints (V sparse) and Galerkin reduction (V dense) are the same function, and the result is
again a System.

Source of the equations: Hou, Liu, Hu, CMAME 361 (2020) 112690, doi 10.1016/j.cma.2019.112690, eqs.
(2), (21).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, fields, replace
from threading import RLock
from typing import Annotated, Any, TypeAlias

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import spsolve

from ..bodies.laws import Law
from ..core.algebra.linalg import as_csr, is_sparse, is_zero
from ..core.errors import InputError, say
from ..core.storage.container import storable
from ..core.storage.records import dataclass
from ..core.storage.validation import Attributes, Indices, Inside, Number, Range, Reals
from ..core.values.arguments import checked
from .affine import Affine, Matrix
from .connections.constraint_laws import LawRows
from .forces.on_rows import is_force
from .prepared import COMPILED
from .terms import elastic as terms

# 1e-16 of a penalty times lengths squared is more than the strain energy of a shell that bends by
# micrometres
SPRINGS = 1e-13  #: part of the sizes that a sum of forces of springs is made of which is round-off

MAKING = RLock()

Signal: TypeAlias = Callable[[np.ndarray], np.ndarray]  #: a scalar function of time, vectorised


@storable
@dataclass(frozen=True)
class Elastic:
    """Strain energy of one body or component, of a storage of any type that registers with
    `terms.elastic`.

    `name` is that of the body or component; loads that follow a surface are such terms as well,
    with their own names.
    """

    name: str
    beta: Annotated[float, Number()]  #: stiffness-proportional damping time [s]
    #: storage, see `terms`: cells act on the body coordinates q = lift(x), points and polynomials
    #: on x
    gather: Annotated[Any, Inside("c n q", terms.is_storage)]


@storable
@dataclass(frozen=True)
class Constraints:
    """Constraints in probe rows y: polynomials as sums of t terms, and rows by laws.

        Phi_row += coefficient s(t) y_i y_j         -1 in place of `signal`, `i` or `j` for a factor that is absent

    Every row m has a name, the joint and its coordinate.
    """

    #: (joint, coordinate) of every row
    names: Annotated[tuple[tuple[str, str], ...], Attributes("m")] = ()
    row: Annotated[np.ndarray, Indices("t", end="m")] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    coefficient: Annotated[np.ndarray, Reals("t")] = field(default_factory=lambda: np.zeros(0))
    signal: Annotated[np.ndarray, Indices("t", end="k", low=-1)] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    i: Annotated[np.ndarray, Indices("t", end="y", low=-1)] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    j: Annotated[np.ndarray, Indices("t", end="y", low=-1)] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    laws: Annotated[tuple[LawRows, ...], Inside("m y k")] = ()
    #: joints that events release or lock: none of their rows is eliminated or follows from others
    loose: tuple[str, ...] = ()
    #: joints that hold edges: where these meet, rows of one follow from those of others
    edges: tuple[str, ...] = ()


@storable
@dataclass(frozen=True)
class Lock:
    """Rows that hold two places together from an event on, and the numbers s of them that are read
    of the state then.

    `numbers` are polynomials in probe rows, one a number, as constraints are; each is the value of
    one of the `signals`. So are those of the `gap` between the places, see `events.gap_of`.
    """

    joint: str
    rows: Annotated[Constraints, Inside("y k")]
    numbers: Annotated[Constraints, Inside("y k m=l")]
    signals: Annotated[np.ndarray, Indices("l", end="k")]
    gap: Annotated[Constraints, Inside("y k")] = field(default_factory=Constraints)
    #: a joint: where it is released, this lock holds what nothing else determines then
    parks: str = ""


@storable
@dataclass(frozen=True)
class Trigger:
    """An event: the value that crosses zero, and what happens then.

    The value is one of those that expressions of outputs give in accepted states; `control.events`
    acts on it.
    """

    name: str
    value: int  #: number of the value that is read, see `readings`
    direction: int  #: 1 rising, -1 falling, 0 both
    stop: bool
    release: tuple[str, ...]  #: joints
    lock: tuple[str, ...]
    once: bool = False  #: whether it happens the first time alone
    #: number of the value that is positive where a condition holds, see `core.values.conditions`
    margin: int | None = None
    alone: bool = False  #: whether that condition is one comparison, which nothing guards where it is no number


@storable
@dataclass(frozen=True)
class Loads:
    """Constant generalised force (n,) [N], and forces on probe rows, which register with
    `forces.on_rows`.
    """

    constant: Annotated[np.ndarray, Reals("n")]
    forces: Annotated[tuple[Any, ...], Inside("y k", is_force)] = ()
    #: (n,) what a change of coordinates has made of linear springs in `constant`, no load; empty
    #: where it has met none
    springs: Annotated[np.ndarray, Reals("*")] = field(default_factory=lambda: np.zeros(0))


@storable
@dataclass(frozen=True)
class LineSamples:
    """What a picture needs of a line or rigid body: samples of its centre line as affine functions
    of the body coordinates q.

    With x points, samples @ q is (3 c x,): positions [m], then dr/dS [-], then d2r/dS2 [1/m].
    """

    name: str
    samples: Annotated[csr_array, Reals("3cx q")]  #: positions, then d/dS, then d2/dS2
    radius: float  #: [m]
    law: Law
    #: what its sections add, see `measures.beam_sections` and `measures.cable_sections`; no default
    #: of the class, so that it is made later
    swept: Annotated[Any, Inside("q")] = field(default_factory=lambda: None)

    @classmethod
    def later(
        cls,
        name: str,
        samples: Callable[[], csr_array],
        radius: float,
        law: Law,
        swept: Callable[[], Any],
    ) -> LineSamples:
        """A line whose samples and sections are made when they are first read: most runs draw no
        picture.
        """
        line = object.__new__(cls)
        made = {"make samples": samples, "make swept": swept}
        line.__dict__.update(name=name, radius=radius, law=law, **made)
        return line

    def __getattr__(self, name: str) -> Any:
        if name not in ("samples", "swept"):
            raise AttributeError(f"'Line' has no attribute '{name}'")
        with MAKING:  # threads may draw one model at the same time
            if name not in self.__dict__:
                self.__dict__[name] = self.__dict__.pop(f"make {name}")()
        return self.__dict__[name]

    def __getstate__(self) -> dict[str, Any]:
        """Copies and pickles have the samples."""
        return {one.name: getattr(self, one.name) for one in fields(self)}


@storable
@dataclass(frozen=True)
class Skin:
    """What a picture needs of a plate or shell, or of the boundary of a solid: samples of its middle
    surface, samples @ q[columns].reshape(b, c).

    Of x points the first x rows are positions [m], the next ones the k vectors that the law reads,
    x rows each.
    """

    name: str
    #: positions, then the vectors of the law in local coordinates
    samples: Annotated[csr_array, Reals("x+kx b")]
    columns: Annotated[slice, Range("bc", end="q")]  #: of the body in q
    cells: Annotated[np.ndarray, Indices("f 4", end="x")]  #: quadrilaterals of samples
    thickness: Annotated[np.ndarray, Reals("x")]  #: [m]
    law: Annotated[Law, Attributes("k=vectors i=rows")]
    section: Annotated[np.ndarray, Reals("i 1 x")]  #: rows of the law
    points: int = 0  #: of a face of a solid, one face after the other


@storable
@dataclass(frozen=True)
class Output:
    """A named output: `kind` and the sensor rows it reads.

    `kind` is the word of the class that evaluates it (`measures.probes.kind_of`), `parameters` are
    the numbers that this class needs.
    """

    kind: str
    rows: tuple[int, ...]
    columns: tuple[str, ...]
    joint: str = ""
    parameters: tuple[float, ...] = ()
    labels: tuple[str, ...] = ()  #: what its columns are, where their names do not say it
    body: str = ""  #: the plate, shell or solid on which it is read, of stresses
    #: there, in the reference (c,), of several places of a solid (c m,) [m]
    place: tuple[float, ...] = ()
    law: Law | None = None  #: by which stresses of a solid follow from its gradients


@storable
@dataclass(frozen=True, repr=False)
class System:
    """A mechanical system in unknowns x (n,), with body coordinates q = lift(x).

        M x'' + C x' + K x + sum_j L_j^T phi_j(L_j x) - Q(x, x', t) + Phi_x^T lambda = 0,     Phi(x, t) = 0

    Full, reduced and hyper-reduced systems are of this one type. It is immutable:
    `dataclasses.replace`, `change_coordinates` and `keep_constraints` make others of it.
    `check_system` tests one.
    """

    dim: Annotated[int, Attributes("c", among=(2, 3))]
    lift: Annotated[Affine, Inside("i=q j=n")]  #: x -> q, all body coordinates
    mass: Annotated[Matrix, Reals("n n")]
    damping: Annotated[Matrix, Reals("n n")]  #: mass-proportional
    stiffness: Annotated[Matrix, Reals("n n")]  #: linear springs, force stiffness @ x
    elastic: Annotated[tuple[Elastic, ...], Inside("c n q")]
    probes: Annotated[Affine, Inside("i=y j=n")]  #: x -> y, rows read by joints and loads
    constraints: Annotated[Constraints, Inside("y k")]
    loads: Annotated[Loads, Inside("c n y k")]
    signals: Annotated[tuple[Signal, ...], Attributes("k")]
    sensors: Annotated[Affine, Inside("i=s j=n")]  #: x -> rows read by outputs
    outputs: Annotated[dict[str, Output], Inside("c s")]
    lines: Annotated[tuple[LineSamples, ...], Inside("c q")]
    skins: Annotated[tuple[Skin, ...], Inside("c q")]
    #: joints in pictures: name, kind, sensor rows
    markers: tuple[tuple[str, str, tuple[int, ...]], ...]
    coordinates: tuple[tuple[str, int, int], ...]  #: (body, first, last + 1) in q
    #: (component, first, last + 1) in x; empty for full models
    components: tuple[tuple[str, int, int], ...]
    x0: Annotated[np.ndarray, Reals("n")]
    v0: Annotated[np.ndarray, Reals("n")]
    unit: Annotated[np.ndarray, Reals("u")]  #: (q / c,) coordinates of the field 1 in q
    #: mass, with unknowns that have none by the length they stand for [kg m2 per unit2]
    metric: Annotated[Matrix, Reals("n n")]
    #: mass that the norm sqrt(u^T metric u / weight) of displacements refers to [kg]
    weight: Annotated[float, Number(0.0)]
    #: size of the mechanism, to which Newton's tolerance refers [m]
    scale: Annotated[float, Number(0.0)]
    #: of q and of fixed points; sensors and pictures count from that of the scene [m]
    origin: Annotated[np.ndarray, Reals("c")]
    locks: Annotated[tuple[Lock, ...], Inside("y k")] = ()
    triggers: tuple[Trigger, ...] = ()
    readings: tuple[Any, ...] = ()  #: what controllers and events read of outputs, see `readings`
    monitors: tuple[Any, ...] = ()  #: what looks at runs, see `monitors`
    full: System | None = None  #: the form with all multipliers, from which reactions are recovered
    #: (n,) a state near the equilibrium of the loads at t = 0, of reduced systems whose motions
    #: start there; empty elsewhere
    near: Annotated[np.ndarray, Reals("*")] = field(default_factory=lambda: np.zeros(0))

    @property
    def size(self) -> int:
        """Number n of unknowns."""
        return len(self.x0)

    @property
    def modes(self) -> dict[str, int]:
        """Number of modes of every component of a reduced system."""
        return {name: last - first for name, first, last in self.components}

    def __repr__(self) -> str:
        bodies = ", ".join(name for name, _, _ in self.components or self.coordinates)
        return f"<System {self.size} unknowns, {len(self.constraints.names)} constraints: {bodies}>"

    def __getstate__(self) -> dict[str, Any]:
        """Copies and pickles are made of the fields alone."""
        return {key: value for key, value in self.__dict__.items() if key != COMPILED}


def in_scene(system: System, q: np.ndarray) -> np.ndarray:
    """Body coordinates (..., q) [m] from the origin of the scene, of those from the origin of the
    system.

        q + unit (x) origin

    A system far from that origin counts its coordinates from a point of its own, see `lengths`.
    """
    return q + np.kron(system.unit, system.origin)


def sizes(system: System, displacements: np.ndarray) -> np.ndarray:
    """Root mean squares (s,) [m] of displacements (s, n) or (n,) of the unknowns over the mass.

        |u| = sqrt(u^T W u / w)

    W (n, n) is `system.metric`, w `system.weight` [kg]; of velocities it gives [m/s].
    """
    u = np.ascontiguousarray(np.atleast_2d(displacements).T)
    return np.sqrt(
        np.maximum(np.einsum("ns,ns->s", u, np.asarray(system.metric @ u)), 0.0) / system.weight
    )


def is_linear(constraints: Constraints) -> np.ndarray:
    """Rows that are linear in the unknowns, independent of time and never let loose, (m,) bool.

    Rows by a law are never counted as linear.
    """
    linear = ~loose_rows(constraints)
    np.logical_and.at(linear, constraints.row, (constraints.signal < 0) & (constraints.j < 0))
    for own in constraints.laws:
        linear[own.row] = False
    return linear


def loose_rows(constraints: Constraints) -> np.ndarray:
    """Rows of joints that events release or lock, (m,) bool: none of them is eliminated."""
    return np.array([joint in constraints.loose for joint, _ in constraints.names], dtype=bool)


def driving(constraints: Constraints) -> list[tuple[int, int]]:
    """Pairs of a row and a signal that it reads, in its terms or by a law; a row may come more than
    once.
    """
    pairs = [(constraints.row, constraints.signal)]
    pairs += [(own.row, signals) for own in constraints.laws for signals in own.signals.T]
    return [
        (int(row), int(k))
        for rows, signals in pairs
        for row, k in zip(rows, signals, strict=True)
        if k >= 0
    ]


def driven_rows(constraints: Constraints) -> np.ndarray:
    """Rows that read a signal, (m,) bool: those of drives."""
    driven = np.zeros(len(constraints.names), dtype=bool)
    driven[[row for row, _ in driving(constraints)]] = True
    return driven


def reads(constraints: Constraints, count: int) -> csr_array:
    """Which of `count` probe rows every row reads, in any position: ones (m, y), whatever their
    coefficients are.
    """
    pairs = [(constraints.row, part) for part in (constraints.i, constraints.j)]
    pairs += [(own.row, part) for own in constraints.laws for part in own.rows.T]
    row, column = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    on = column >= 0
    found = csr_array(
        (np.ones(int(on.sum())), (row[on], column[on])), shape=(len(constraints.names), count)
    )
    found.data[:] = 1.0
    return found


def linear_part(system: System) -> tuple[np.ndarray, csr_array, np.ndarray]:
    """Time-independent linear constraints: row numbers (i,), A (i, n), a (i,).

        A x + a = 0

    They are the rows of `is_linear`, in the order of `system.constraints.names`, as a sparse array.
    """
    rows, A, a = linear_rows(system)
    return rows, as_csr(A), a


def linear_rows(system: System) -> tuple[np.ndarray, Matrix, np.ndarray]:
    """As `linear_part`, with A (i, n) dense where the matrix of the probes is, as in reduced
    systems.
    """
    terms = system.constraints
    rows = np.flatnonzero(is_linear(terms))
    place = np.full(len(terms.names), -1)
    place[rows] = np.arange(len(rows))
    mine = place[terms.row] >= 0
    on = mine & (terms.i >= 0)
    row = place[terms.row[on]]
    i = terms.i[on]
    value = terms.coefficient[on]
    P = system.probes.matrix
    a = np.zeros(len(rows))
    np.add.at(a, place[terms.row[mine & ~on]], terms.coefficient[mine & ~on])
    np.add.at(a, row, value * system.probes.offset[i])
    if isinstance(P, np.ndarray):
        A = np.zeros((len(rows), system.size))
        np.add.at(A, row, value[:, None] * P[i])
        return rows, A, a
    return rows, as_csr(csr_array((value, (row, i)), shape=(len(rows), len(P.indptr) - 1)) @ P), a


def keep_constraints(system: System, rows: np.ndarray) -> System:
    """The system with the given constraint rows (i,) only, in their order; everything else stays,
    and so does `full`.
    """
    terms = system.constraints
    place = np.full(len(terms.names), -1)
    place[rows] = np.arange(len(rows))
    mine = place[terms.row] >= 0
    names = tuple(terms.names[k] for k in rows)
    laws = tuple(part for own in terms.laws if len(part := own.kept(place)))
    value, signal, i, j = (
        part[mine] for part in (terms.coefficient, terms.signal, terms.i, terms.j)
    )
    kept = Constraints(
        names, place[terms.row[mine]], value, signal, i, j, laws, terms.loose, terms.edges
    )
    return replace(system, constraints=kept)


@checked
def change_coordinates(system: System, V: Matrix, d: np.ndarray) -> System:
    """The same system in unknowns z (r,) with x = V z + d, equations projected by V^T: V (n, r)
    sparse or dense, d (n,).

        M <- V^T M V,   C <- V^T C V,   K <- V^T K V,   Q <- V^T (Q - K d),   P <- P V,   y0 <- P d + y0

    Cells stay in body coordinates, points in the unknowns are multiplied by V. x0 and v0 are
    projected orthogonally; they are exact when they lie in the range of V. InputError where an
    elastic term is a polynomial of the unknowns, which stays in them.

        >>> import numpy as np
        >>> from fmbs_skfem.bodies import point_mass
        >>> from fmbs_skfem.systems import assemble, change_coordinates
        >>> plane = assemble([point_mass("bead", 2.0, np.zeros(2))])
        >>> line = change_coordinates(plane, np.array([[3.0], [4.0]]), np.zeros(2))
        >>> line.mass.tolist()  # V^T M V
        [[50.0]]
    """

    if V.ndim != 2 or V.shape[0] != system.size or np.shape(d) != (system.size,):
        got = f"V {V.shape}, d {np.shape(d)}"
        raise InputError(
            say("change_coordinates", f"V ({system.size}, r) and d ({system.size},)", got)
        )
    kept = chosen(V)
    across = V.T if isinstance(V, np.ndarray) else as_csr(V.T)

    def square(A: Matrix) -> Matrix:
        if (
            is_sparse(A) and is_zero(A) and is_sparse(V)
        ):  # of damping and springs that most systems do not have
            return csr_array((V.shape[1], V.shape[1]))
        if kept is not None and is_sparse(A):
            return as_csr(as_csr(A[kept])[:, kept])
        product = across @ (A @ V)
        if is_sparse(product):
            product.sum_duplicates()  # which sorts each row: matrices are in one form however they were made
        return product

    def compose(affine: Affine) -> Affine:
        if kept is not None and is_sparse(affine.matrix):
            return Affine(as_csr(affine.matrix[:, kept]), affine(d))
        product = affine.matrix @ V
        return Affine(as_csr(product) if is_sparse(product) else product, affine(d))

    def carry(elastic: Elastic) -> Elastic:
        return replace(elastic, gather=terms.carry(elastic.gather, elastic.name, lift, V, d))

    lift = compose(system.lift)
    mass = square(system.mass)
    pull = system.stiffness @ d
    return replace(
        system,
        lift=lift,
        mass=mass,
        metric=mass if system.metric is system.mass else square(system.metric),
        damping=square(system.damping),
        stiffness=square(system.stiffness),
        elastic=tuple(carry(e) for e in system.elastic),
        probes=compose(system.probes),
        sensors=compose(system.sensors),
        loads=replace(
            system.loads,
            constant=across @ (system.loads.constant - pull),
            springs=moved_springs(system, V, d, pull),
        ),
        x0=project(V, system.x0 - d),
        v0=project(V, system.v0),
        near=project(V, system.near - d) if len(system.near) else system.near,
    )


def project(V: Matrix, x: np.ndarray) -> np.ndarray:
    """The z (r,) or (r, i) for which V z is nearest to x (n,) or columns x (n, i), V (n, r) of full
    rank.

        |V z - x| -> min

    Sparse V by the normal equations, dense V by least squares; a V that only chooses unknowns takes
    them as they are.
    """
    if not x.any():
        return np.zeros((V.shape[1], *x.shape[1:]))
    if (kept := chosen(V)) is not None:
        return np.asarray(x[kept])
    if not isinstance(V, np.ndarray):
        return np.asarray(spsolve((V.T @ V).tocsc(), V.T @ x)).reshape(V.shape[1], *x.shape[1:])
    return np.linalg.lstsq(V, x, rcond=None)[0]


def moved_springs(system: System, V: Matrix, d: np.ndarray, pull: np.ndarray) -> np.ndarray:
    """Constant part (r,) of the force of linear springs in other unknowns.

        x = V z + d,    pull = K d

    the latter without its round-off.
    """
    size = np.zeros(0) if is_zero(system.stiffness) else abs(system.stiffness) @ np.abs(d)
    if not size.any():
        return V.T @ system.loads.springs if len(system.loads.springs) else system.loads.springs
    own = system.loads.springs if len(system.loads.springs) else np.zeros(system.size)
    return np.asarray(V.T @ (own - np.where(np.abs(pull) > SPRINGS * size, pull, 0.0)))


def multiply_out(system: System) -> System:
    """The same reduced system with the cells of its bodies as points in the unknowns, to choose
    among; a full one stays.

    Its energy, forces and tangents are the same, its arrays larger: a row of modes for every
    gradient at every point.
    """
    return replace(
        system,
        elastic=tuple(
            replace(e, gather=terms.multiply_out(e.gather, system.lift)) for e in system.elastic
        ),
    )


def chosen(V: Matrix) -> np.ndarray | None:
    """The rows (r,) that a sparse V takes as they are, one a column, where it does nothing else:
    held edges, fixed points.
    """
    if isinstance(V, np.ndarray) or V.nnz != V.shape[1] or np.any(V.data != 1.0):
        return None
    across = as_csr(V.T)
    return (
        across.indices
        if (np.diff(as_csr(V).indptr) <= 1).all() and (np.diff(across.indptr) == 1).all()
        else None
    )
