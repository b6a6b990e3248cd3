r"""One time step of many members over an array namespace: pure functions of `Structure` and `Data`.

    W_b = bh M + gh C + K + G^T phi'(u_b) G,    dz_b = - [[c W_b + d(Phi_q^T lambda)/dq, Phi_q^T], [Phi_q, 0]]^-1 residual_b

Residual and matrix are those of `stepping`; terms of constraints and loads meet their probe rows in products with matrices of 0 and
1, so that nothing is assigned to parts of arrays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

from ..bodies.laws import Law
from . import array_laws, stepping

Array: TypeAlias = Any  #: an array of the namespace


class Group(NamedTuple):
    """Sampled points of one body."""

    jets: Array  #: (k c p, r), shared
    offset: Array  #: (k c p,)
    section: Array  #: (b, i, p)


class Data(NamedTuple):
    """Arrays of all members, b first; arrays without b are shared."""

    method: Array  #: (b, 8, 1) coefficients h, am, af, gamma, beta, bh, gh, c
    mass: Array  #: (b, n, n)
    damping: Array
    stiffness: Array
    load: Array  #: (b, n)
    norm: Array  #: (b, n) weights of the unknowns in the norm of a displacement
    groups: tuple[Group, ...]
    P: Array  #: (j, n) probe rows
    offset: Array  #: (b, j)
    terms: Array  #: (b, t) coefficients of the constraints
    term_rows: Array  #: (t, m)
    first: Array  #: (t, j) which probe row is the first factor of a term, none for constants
    second: Array
    quadratic: Array  #: (t,) 1 for terms with two factors
    loads: Array  #: (b, l) coefficients of the loads
    load_rows: Array  #: (l, j)


class Trial(NamedTuple):
    """State in the iteration."""

    x: Array  #: (b, n)
    v: Array
    a: Array
    multipliers: Array  #: (b, m), c times the physical ones


class State(NamedTuple):
    """Motion at the end of a step."""

    x: Array
    v: Array
    a: Array
    acceleration: Array
    multipliers: Array
    history: Array  #: (b, 3, n) earlier q'', latest first
    past: Array  #: (b, 3, m) earlier multipliers, latest first
    order: Array  #: (b,)
    change: Array  #: (b,) size of the second difference of q'' [m/s2], infinite where it is not known


@dataclass(frozen=True)
class Structure:
    """What is not an array: the namespace, laws and columns of the groups."""

    xp: Any
    laws: tuple[Law, ...]
    columns: tuple[slice, ...]
    shapes: tuple[tuple[int, int, int], ...]  #: (k, c, p) of every group


def product(matrices: Array, vectors: Array) -> Array:
    """Matrix times vector, member by member."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


def jets(s: Structure, d: Data, k: int, x: Array) -> Array:
    """Jets (b, k, c, p) of a group."""
    return (x[:, s.columns[k]] @ d.groups[k].jets.T + d.groups[k].offset).reshape(-1, *s.shapes[k])


def placed(s: Structure, k: int, part: Array, n: int) -> Array:
    """Entries (b, r) of a group in rows (b, n)."""
    before, after = s.columns[k].start, n - s.columns[k].stop
    return s.xp.pad(part, ((0, 0), (before, after)))


def elastic_force(s: Structure, d: Data, x: Array) -> Array:
    """sum G^T phi(G x + g), (b, n)."""
    total = s.xp.zeros_like(x)
    for k, group in enumerate(d.groups):
        S = array_laws.stress(s.xp, s.laws[k], jets(s, d, k, x), group.section)
        total = total + placed(s, k, S.reshape(len(x), -1) @ group.jets, x.shape[1])
    return total


def elastic_tangent(s: Structure, d: Data, x: Array) -> Array:
    """sum G^T phi' G, (b, n, n)."""
    total = s.xp.zeros_like(d.mass)
    for k, group in enumerate(d.groups):
        D = array_laws.modulus(s.xp, s.laws[k], jets(s, d, k, x), group.section)
        G = group.jets.reshape(D.shape[1], D.shape[3], -1)
        DG = s.xp.einsum("bijp,jpr->bipr", D, G).reshape(len(x), -1, G.shape[2])
        rows, n = s.columns[k], x.shape[1]
        room = (rows.start, n - rows.stop)
        total = total + s.xp.pad(group.jets.T @ DG, ((0, 0), room, room))
    return total


def constraints(d: Data, y: Array, signals: Array) -> tuple[Array, Array, Array]:
    """Coefficients s(t) c (b, t), Phi (b, m) and dPhi/dy (b, m, j)."""
    values = d.terms * signals
    left = y @ d.first.T + (1.0 - d.first.sum(axis=1))
    right = y @ d.second.T + (1.0 - d.second.sum(axis=1))
    phi = (values * left * right) @ d.term_rows
    slopes = (values * right)[:, :, None] * d.first + (values * left)[:, :, None] * d.second
    return values, phi, d.term_rows.T @ slopes


def residual(s: Structure, d: Data, q: Trial, term_signals: Array, load_signals: Array) -> Array:
    """(c (M q'' + f) + Phi_q^T lambda, Phi), (b, n + m)."""
    c = d.method[:, 7]
    y = q.x @ d.P.T + d.offset
    _, phi, slopes = constraints(d, y, term_signals)
    forces = elastic_force(s, d, q.x) + product(d.mass, q.a) + product(d.damping, q.v) + product(d.stiffness, q.x) - d.load
    on_rows = product(s.xp.swapaxes(slopes, 1, 2), q.multipliers) - c * ((d.loads * load_signals) @ d.load_rows)
    return s.xp.concatenate([c * forces + on_rows @ d.P, phi], axis=1)


def inverses(s: Structure, d: Data, q: Trial, term_signals: Array) -> Array:
    """Inverse of [[c W + d(Phi_q^T lambda)/dq, Phi_q^T], [Phi_q, 0]], (b, n + m, n + m)."""
    bh, gh, c = (d.method[:, k][:, :, None] for k in (5, 6, 7))
    y = q.x @ d.P.T + d.offset
    values, _, slopes = constraints(d, y, term_signals)
    W = c * (bh * d.mass + gh * d.damping + d.stiffness + elastic_tangent(s, d, q.x))
    pull = values * (q.multipliers @ d.term_rows.T) * d.quadratic
    H = s.xp.einsum("bt,ti,tj->bij", pull, d.first, d.second)
    W = W + d.P.T @ (H + s.xp.swapaxes(H, 1, 2)) @ d.P
    J = slopes @ d.P
    nothing = s.xp.zeros((J.shape[0], J.shape[1], J.shape[1]))
    above, below = s.xp.concatenate([W, s.xp.swapaxes(J, 1, 2)], axis=2), s.xp.concatenate([J, nothing], axis=2)
    return s.xp.linalg.inv(s.xp.concatenate([above, below], axis=1))


def correction(
    s: Structure, d: Data, inverse: Array, q: Trial, term_signals: Array, load_signals: Array
) -> tuple[Trial, Array, Array]:
    """One Newton correction of all members, and the sizes of dq [m] and of the correction of the multipliers, (b,) each."""
    dz = product(inverse, residual(s, d, q, term_signals, load_signals))
    n = q.x.shape[1]
    bh, gh, dq = d.method[:, 5], d.method[:, 6], dz[:, :n]
    moved = Trial(q.x - dq, q.v - gh * dq, q.a - bh * dq, q.multipliers - dz[:, n:])
    return moved, s.xp.sqrt((d.norm * dq * dq).sum(axis=1)), s.xp.sqrt((dz[:, n:] ** 2).sum(axis=1))


def algorithmic(d: Data, state: State, acceleration: Array) -> Array:
    """a1 from (1 - am) a1 + am a0 = (1 - af) q1'' + af q0''."""
    am, af = d.method[:, 1], d.method[:, 2]
    return ((1.0 - af) * acceleration + af * state.acceleration - am * state.a) / (1.0 - am)


def extrapolations(s: Structure, history: Array) -> Array:
    """Constant, linear and quadratic extrapolation by one step, (b, 3, n)."""
    weights = s.xp.asarray([[1.0, 0.0, 0.0], [2.0, -1.0, 0.0], [3.0, -3.0, 1.0]])
    return s.xp.einsum("ok,bkn->bon", weights, history)


def predict(s: Structure, d: Data, state: State) -> Trial:
    """Trial state from extrapolated q'' and multipliers."""
    h, gamma, beta = d.method[:, 0], d.method[:, 3], d.method[:, 4]
    picked = state.order[:, None] == s.xp.arange(stepping.HISTORY)[None, :]
    guess, force = ((extrapolations(s, past) * picked[:, :, None]).sum(axis=1) for past in (state.history, state.past))
    a1 = algorithmic(d, state, guess)
    x = state.x + h * state.v + h * h * ((0.5 - beta) * state.a + beta * a1)
    return Trial(x, state.v + h * ((1.0 - gamma) * state.a + gamma * a1), guess, force)


def accept(s: Structure, d: Data, state: State, q: Trial, known: Array, live: Array) -> State:
    """The converged trial state, with the predictor that was best among the first `known` ones; others than `live` stay."""
    errors = (d.norm[:, None] * (extrapolations(s, state.history) - q.a[:, None]) ** 2).sum(axis=2)
    change = s.xp.where(known > 1, s.xp.sqrt(errors[:, 1]), s.xp.inf)
    errors = s.xp.where(s.xp.arange(stepping.HISTORY)[None, :] < known, errors, s.xp.inf)
    order = s.xp.argmin(errors, axis=1) + (known < stepping.HISTORY)
    history = s.xp.concatenate([q.a[:, None], state.history[:, :-1]], axis=1)
    past = s.xp.concatenate([q.multipliers[:, None], state.past[:, :-1]], axis=1)
    return chosen(s, live, State(q.x, q.v, algorithmic(d, state, q.a), q.a, q.multipliers, history, past, order, change), state)


def drift(s: Structure, d: Data, state: State, signals: Array) -> Array:
    """What the accepted velocities are off (4) of `stepping`, (b, m); `signals` (b, 4, t) are values and three derivatives."""
    h, am, af, beta = (d.method[:, k] for k in (0, 1, 2, 4))
    second, third = h * (0.5 - beta), h * h * (1.0 / 6.0 - beta * (1.0 + am - af))
    paths = [state.x @ d.P.T + d.offset, *(part @ d.P.T for part in (state.v + second * state.a, state.v, state.acceleration))]
    left, right = ([path @ rows.T for path in paths] for rows in (d.first, d.second))
    y, Y = left[0] + (1.0 - d.first.sum(axis=1)), right[0] + (1.0 - d.second.sum(axis=1))
    (z, v, a), (Z, V, A) = left[1:], right[1:]
    p, pz, p1, p2 = y * Y, y * Z + z * Y, y * V + v * Y, y * A + 2.0 * v * V + a * Y
    s0, s1, s2, s3 = (signals[:, k] for k in range(4))
    two = s2 * p + 2.0 * s1 * p1 + 2.0 * s0 * v * V
    three = s3 * p + 3.0 * (s2 * p1 + s1 * p2) + 3.0 * s0 * (v * A + a * V)
    return (d.terms * (s0 * pz + s1 * p + second * two + third * three)) @ d.term_rows


def settle(s: Structure, d: Data, state: State, inverse: Array, signals: Array, live: Array) -> tuple[State, Array]:
    """The accepted velocities put onto (4) of `stepping` for the members `live`, and whose inverses are too old for that (b,)."""
    r, n = drift(s, d, state, signals), state.x.shape[1]
    slopes = constraints(d, state.x @ d.P.T + d.offset, signals[:, 0])[2]
    first = product(inverse[:, :, n:], r)
    pull = -product(s.xp.swapaxes(slopes, 1, 2), first[:, n:]) @ d.P
    turned = s.xp.concatenate([pull, 2.0 * r - product(slopes, first[:, :n] @ d.P.T)], axis=1)
    off = product(inverse[:, :n], turned)
    missed = r - product(slopes, off @ d.P.T)
    old = live & ((missed**2).sum(axis=1) > stepping.OLD**2 * (r**2).sum(axis=1))
    good = live & ~old & ((d.norm * off**2).sum(axis=1) <= (d.norm * state.v**2).sum(axis=1))
    return state._replace(v=s.xp.where(good[:, None], state.v - off, state.v)), old


def chosen(s: Structure, mask: Array, new: Any, old: Any) -> Any:
    """Rows of `new` where the mask (b,) holds, else of `old`, in every array of a tuple."""
    parts = zip(new, old, strict=True)
    return type(new)(*(s.xp.where(mask.reshape(-1, *(1,) * (a.ndim - 1)), a, b) for a, b in parts))
