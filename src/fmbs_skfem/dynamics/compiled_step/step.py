"""The structs of a compiled time step, which routines open from one address."""

from __future__ import annotations

from typing import NamedTuple

from ...core.compiling.structs import Cube, IntegerMatrix, Integers, Matrix, Shorts, Vector, opener
from ...systems.evaluation import Arrays, Space


# all numbers that depend on h: a divided step replaces this struct alone, and compiles nothing
class Method(NamedTuple):
    """Coefficients of one step size, and the controls of the iteration."""

    h: float
    am: float
    af: float
    gamma: float
    beta: float
    bh: float
    gh: float
    c: float
    tolerance: float  #: on the remaining error of q [m]
    iterations: int
    slow: float  #: contraction above which the matrix is factored anew for the next step
    floor: float  #: round-off of q [m]
    sharp: float  #: remaining error of q over the second difference of q'' [s2]
    share: float  #: remaining error of q over the first correction of a step
    unseen: float  #: error of q that may remain whatever the first correction was [m]
    judging: bool  #: whether steps are refused where forces begin or end too fast, something is passed through, or corrections grow
    again: bool  #: whether a step that failed is tried once more, from a straight way
    trusting: bool  #: whether a contraction of steps before may be relied on
    local: float  #: error of a step from which it is taken in parts [m], 0 for equal steps
    allowed: float  #: change of speed by forces that begin or end in a step, over the one that they allow
    locating: bool  #: whether a step that is refused since a force begins in it says so, to end where that does


# arrays in place, so that addresses of a packed step stay valid from step to step
class State(NamedTuple):
    """Motion at one instant; arrays are updated in place."""

    x: Vector
    v: Vector
    a: Vector  #: algorithmic acceleration
    acceleration: Vector  #: q''
    multipliers: Vector  #: c times the physical ones
    history: Matrix  #: (3, n) earlier q'', latest first
    past: Matrix  #: (3, m) earlier multipliers, latest first
    known: Integers  #: (1,) number of valid rows of history and past
    order: Integers  #: (1,) order of the predictor
    memory: Vector  #: (l,) what forces keep of it
    speed: Vector  #: (1,) largest speed so far, root mean square [m/s]
    parts: Integers  #: (1,) halvings of the next step
    change: (
        Vector  #: (1,) size of the second difference of q'' [m/s2], infinite where it is not known
    )
    work: Vector  #: (2,) of all that has no potential so far, and heat of elastic damping in it [J], see `systems.work`
    push: Vector  #: (n,) its forces now
    gradients: Vector  #: (g,) of terms that read velocities, the second row of those of the space
    signals: Vector  #: (s,) their values, none where histories change nothing at a standstill


# tables of `beam_points`, and what `rotated` writes
class Rotations(NamedTuple):
    """Vectors of beams that rotate with k of their points, g by themselves, and s that t sides of
    beams share; c components.
    """

    groups: IntegerMatrix  #: (g, c) unknowns of vectors, -1 for components that are none
    turned: Integers  #: (g,) the points that they rotate with
    owners: Integers  #: (g,) their beams, -1 for vectors that a translation leaves as they are
    shared: IntegerMatrix  #: (s, c) unknowns of vectors of several beams
    sides: IntegerMatrix  #: (t, 5) shared vector, beam, which of `members` are its unknowns, and the point it rotates with
    members: Integers  #: unknowns of beams that are not shared, beam by beam
    ends: IntegerMatrix  #: (k, 3) first coordinates of the three directors of a point, or of the points after and before it and -1
    start: Matrix  #: (k, c c) directors made orthonormal, row by row, or a direction, when W was factored
    turns: Matrix  #: (k, c c) rotations since, row by row
    columns: Matrix  #: (s c, n) of the shared points in W
    reach: Matrix  #: (s c, n) W^-1 of these
    shares: Matrix  #: (t c, t c) of beams in the tangent of the shared points
    rest: Matrix  #: (s c, s c) what is left of it
    border: Matrix  #: (s c, s c) its factors
    pivots: Shorts  #: (s c,)
    pull: Vector  #: (s c,) room of a solution
    lives: Vector  #: (2,) steps that factors serve in the mean, as a whole and rotated
    on: Integers  #: (2,) 1 where factors rotate, 0 where they do not; number of factorisations


# made once a run by `initial.workspace`; empty arrays where a storage needs none
class Workspace(NamedTuple):
    """Factors, and preallocated space of the solver."""

    addresses: Integers
    kkt: Matrix  #: (n + m, n + m) for dense systems, or (n, n): their blocks behind each other
    ends: Integers  #: (n,) of dense blocks, where their first unknowns are
    general: Matrix  #: general band, used where W is indefinite
    pivots: Shorts
    schur: Matrix  #: (m, m), (0, 0) where W and the joints are factored in one
    schur_pivots: Shorts
    spread: Matrix  #: (m, n) W^-1 Phi_q^T
    J: Matrix  #: (m, n)
    lower: Vector  #: L of blocks, as `core.algebra.direct` has it
    diagonal: Vector  #: (n,) D of blocks, or the diagonal of a dense W
    columns: Matrix  #: (1 or m, n) room of a solution with blocks
    front: Vector  #: room of a supernode
    lows: Matrix  #: (r, n) W^-1 U of derivatives of low rank, see `woodbury`
    inner: Vector  #: (r r,) factors of 1 + V^T W^-1 U, or (n n,) of 1 + W^-1 U V^T
    inner_pivots: Shorts
    updates: Matrix  #: (u, n + m) what secants add to solutions with the factors, u of them at most
    shares: Matrix  #: (u, n) by how much: rows of the scalar product with the displacement of a solution
    secants: Integers  #: (1,) number of secants since the factors; the last u are kept
    moved: Vector  #: (n,) displacement of the last correction
    pull: Vector  #: (2,) size of the last correction of the multipliers, infinite before the first; the largest mass [kg]
    rate: Vector  #: (1,) contraction, the largest of late measurements
    #: (4,) kind of the factors, 0: anew; what the next W is made of, see `factors`; kind of those there
    #: are; their age
    kind: Integers


# by address, so that a model compiles the routines of its own storage alone, and large ones may
# have functions of Python there
class Doors(NamedTuple):
    """Addresses of the routines that a step calls."""

    residual: int
    factorise: int  #: factors at the trial state of the space, 0 or the reason for none
    solve: int  #: rhs <- KKT^-1 rhs; its argument is 1 where the front of rhs is zero
    apply: int  #: rows <- W^-1 rows, see `factors`
    settle: int  #: the accepted velocities onto (4); 0 where joints are steady
    take: int  #: one step, by its row of signals
    assemble: int  #: J and W of the factors, see `factors.assemble`
    fill: int = 0  #: `woodbury.fill`, and the two behind it; 0 where no derivatives of low rank are apart from W
    close: int = 0
    correct: int = 0
    divide: int = 0  #: the step that failed, in parts; 0 where `Levels` has none: most runs divide no step, and do not compile it
    follow: int = 0  #: `rotated.follow`, 0 where factors do not rotate; whole W factored and applied behind the two below
    whole: int = 0
    inside: int = 0
    touch: int = 0  #: `touching.take`, 0 where steps do not end where something touches


class StepJob(NamedTuple):
    """Steps to take, and where their results go."""

    signals: Matrix  #: (k, s) a row for every step
    rows: Integers  #: (k,) rows of the trajectory, -1 for none
    out: Cube  #: (3, s, n) x, v, q'' in the order of the system
    order: Integers  #: (n,) the unknowns of the system that those of the state are
    multipliers: Matrix  #: (s, m) physical
    memory: Matrix  #: (s, l)
    work: Vector  #: (s,) [J], empty where no work is counted
    counters: Integers
    #: (3,) steps that were taken; those so far in which something passed through what it touches; 1
    #: while steps do not end where something touches
    done: Integers
    left: Vector  #: (2,) of a step by a fixed number of corrections: size of the last one [m], and how many would do


# addresses, so that a trial of another length changes no number and packs nothing
class Levels(NamedTuple):
    """The step of a job in parts: the lengths that are tried, one after the other, each a `Step` of
    its own method and signals.

    All share space, state, work space and counters.
    """

    tables: Integers  #: (t,) addresses of these steps; none where steps are not divided
    halvings: Integers  #: (t,) of each
    kept: Integers  #: addresses of `Kept`, one for every array of the state
    before: int  #: address of the copy of the state
    held: Integers  #: as `kept`, of a step that goes from touch to touch; none where steps do not
    #: fills the signals of the trials at the ends of so many parts of NOW in `spans`, or at its begin
    #: where there are none; 0 where a system has none
    histories: int
    set_span: int  #: gives these steps the coefficients of parts of JOB in `spans`
    jump: int  #: `stepping.jump`; 0 where no step goes from touch to touch
    spans: Matrix  #: (3, 2) BEGIN and LENGTH [s], rows JOB, NOW and LEAPT
    #: (5,) rows of signals that are numbers in the last trial, its parts that were taken; halvings
    #: of the first step in which something passed through what it touches, -1 for none; those of
    #: the last step; number in the run of the first step of the job, -1 for a piece of a step
    found: Integers


class Step(NamedTuple):
    """All that the routines of a step read and write."""

    space: Space  #: the trial state and what is evaluated there
    arrays: Arrays
    doors: Doors
    state: State
    work: Workspace
    rotations: Rotations
    method: Method
    job: StepJob
    levels: Levels


class Kept(NamedTuple):
    """An array of a state, and its copy before a step; numbers of eight bytes, whatever they are."""

    now: Integers
    before: Integers


class JobStart(NamedTuple):
    """How a `StepJob` begins: what differs from call to call."""

    signals: Matrix
    rows: Integers


# places in an array and no fields: compiled steps add to them, Python reads them while a run is
# watched
NUMBERS, TAKEN, LEAP, LEVEL, NUMBER = range(5)  #: places in `Levels.found`
#: rows of `Levels.spans`: of the first step of the job, of the step that is being taken, or the
#: instant that signals are asked for, and of the step in which something passed through
JOB, NOW, LEAPT = range(3)
BEGIN, LENGTH = range(2)  #: of a span
PASSING = 2  #: place in `StepJob.done`
#: of the change of speed that forces which begin and end allow a step: it may be anywhere in it
LEAST = 1.0 / 2048.0
STEPS, ITERATIONS, FACTORISATIONS, HALVED = range(4)  #: counters of a job

opened = opener(Step)
opened_state = opener(State)
opened_kept = opener(Kept)
