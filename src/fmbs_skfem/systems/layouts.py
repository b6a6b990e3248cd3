"""How the iteration matrix W of a system is stored, and in which order of the unknowns.

    dense     all entries                                  few unknowns, dense bases
    band      band[j, i - j] = W[i, j] for i >= j          full lines and strips
    blocks    the upper triangle by rows, those of a part side by side, factored by supernodes         parts in a mechanism
    sparse    by Python, see `sparse` and `dynamics.compiled_step.large`  large full systems, whose factors turn with the bodies

Functions of a part read each other and few of other parts: eliminated first, its inner unknowns
fill nothing but its joints.
"""

from __future__ import annotations

from dataclasses import field
from enum import Enum
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csr_array, eye_array, triu

from ..core.algebra import saddle, supernodes
from ..core.algebra.linalg import (
    as_csr,
    as_dense,
    distinct,
    entries,
    is_sparse,
    is_zero,
    mirrored,
    others,
    rows_at,
)
from ..core.algebra.supernodes import Tree
from ..core.storage.records import dataclass
from .lengths import LIGHT
from .matrices import band_order, from_lower_band, lower_band, nonzeros
from .prepared import prepare
from .system import System
from .terms import elastic as terms

# steps of a double pendulum, dense and as a band: 24 and 19 us at 42 unknowns, 42 and 28 us at 66,
# 189 and 44 us at 198
DENSE = 48  #: systems of at most this size are dense where nothing speaks for blocks
WIDE = 20_000  #: systems from this size on are sparse without looking for a band
BAND = 96  #: widest band that is factored as a band, whatever the size
# a frame of five beams, three of them welded at a point: 537 unknowns of half width 107 take 1.6 ms
# a step as a band, 16 ms sparse
SHORT = 7  #: numbers of a wider band, over BAND^2, up to which it is one, too: steps of sparse models call Python
WORTH = 0.3  #: part of the numbers of dense or band factors below which blocks are faster: theirs come in shorter rows
NO_TREE = Tree(*(np.zeros(0, kind) for kind in (np.int64, np.int64, np.int64, np.int32, np.int64)))


# 100 parts of a machine take 450 us a step in blocks, 1190 us where no band fits and factors are
# those of large models in Python
class Storage(Enum):
    """How the iteration matrix W (n, n) is stored, see the module: dense, as a lower band, sparse,
    or in blocks.
    """

    DENSE = "dense"
    BAND = "band"
    SPARSE = "sparse"
    BLOCKS = "blocks"


@dataclass(frozen=True)
class Pieces:
    """Elastic storages of a system in t pieces, in the coordinates p of all cells.

        p = matrix @ x + offset

    of the unknowns x (n,).
    """

    matrix: csr_array | np.ndarray  #: p from the unknowns (p, n)
    offset: np.ndarray  #: (p,)
    storages: tuple[Any, ...]
    owners: np.ndarray  #: (t,) number of the elastic part of every piece


@dataclass(frozen=True)
class Layout:
    """The storage of W (n, n), with the unknowns in an order: place k of the storage belongs to the
    unknown order[k].
    """

    storage: Storage
    order: np.ndarray  #: (n,) unknown at every place
    width: int  #: half bandwidth
    tree: Tree = NO_TREE  #: of blocks
    #: of blocks, the upper triangle in this order
    pattern: csr_array = field(default_factory=lambda: csr_array((0, 0)))
    loose: bool = False  #: whether joints alone determine some unknowns: W may be singular

    @cached_property
    def place(self) -> np.ndarray:
        """(n,) place of every unknown."""
        # cached: targets of all cells and entries of all matrices ask for it
        return np.argsort(self.order)

    @cached_property
    def keys(self) -> np.ndarray:
        """Row times n plus column of all entries of blocks, ascending."""
        # one sorted array, in which any set of entries is found by one search
        rows = np.repeat(np.arange(len(self.order)), np.diff(self.pattern.indptr))
        return np.asarray(rows * len(self.order) + self.pattern.indices)

    @property
    def dense(self) -> bool:
        """Whether all entries are stored, as an array (n, n)."""
        return self.storage is Storage.DENSE

    @property
    def by_rows(self) -> bool:
        """Whether products of constant matrices read their rows: there are no few diagonals."""
        return self.storage in (Storage.SPARSE, Storage.BLOCKS)

    @property
    def numbers(self) -> int:
        """Numbers that the factors of W have, which stand for their cost."""
        if self.storage is Storage.BLOCKS:
            # what a factorisation writes and a solution reads: storages are chosen by it
            return supernodes.entries(self.tree)
        return (
            len(self.order) * self.width
            if self.storage is Storage.BAND
            else len(self.order) ** 2 // 2
        )

    def flat(self, i: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Where entries of rows i (x,) and columns j (x,), places of unknowns, are in the flat
        storage, (x,).

        i >= j where it is not dense.
        """
        if self.dense:
            return i * len(self.order) + j
        if self.storage is Storage.BAND:
            # column by column, the diagonal first: where `substitute` reads a band without a jump
            return j * (self.width + 1) + i - j
        return np.searchsorted(self.keys, j * len(self.order) + i)

    def store(self, A: csr_array | np.ndarray) -> np.ndarray:
        """A symmetric matrix (n, n), with the unknowns as the system has them, in this storage;
        nothing of it where that is sparse.

        Dense (n, n), a lower band (n, width + 1), or the entries (1, z) of blocks.
        """
        if self.storage is Storage.SPARSE:
            # large models keep the matrices of the system as they are
            return np.zeros((0, 1))
        if self.dense:
            return np.ascontiguousarray(as_dense(A))
        if self.storage is Storage.BAND:
            return lower_band(A, self.place, self.width)
        row, column, values = entries(A)
        i, j = self.place[row], self.place[column]
        found = np.zeros((1, self.pattern.nnz))
        low = (i >= j) & (values != 0.0)
        np.add.at(found[0], self.flat(i[low], j[low]), values[low])
        return found

    def matrix(self, W: np.ndarray) -> csr_array | np.ndarray:
        """The symmetric matrix (n, n) of a storage, with the unknowns as the system has them."""
        if self.dense:
            return W.copy()
        if self.storage is Storage.BAND:
            return from_lower_band(W, self.order)
        # one half is stored, since factors read no other
        found = mirrored(
            csr_array((W[0], self.pattern.indices, self.pattern.indptr), shape=self.pattern.shape)
        )
        return csr_array(found[self.place][:, self.place])


def chosen(system: System, parts: Pieces, pairs: np.ndarray, skew: bool) -> Layout:
    """How the iteration matrix of a system is stored, see the module.

    `pairs` (h, 2) of probe rows have second derivatives, `skew` ones or not; `parts` are its
    elastic storages. Reduced systems are dense. Full ones are dense up to `DENSE` unknowns, and up
    to some hundred where a band would be wide; sparse from `WIDE` on, or where a band would be
    wider than `BAND` and not short; else a band. Mechanisms of reduced parts take blocks where
    these have few numbers. Where joints alone determine some unknowns (`loose`), there are neither
    bands nor blocks.
    """
    if not is_sparse(system.lift.matrix):
        # bases are dense, so that W is: there is nothing to choose
        size = system.size
        loose = massless(system, parts)
        return prepare(system).find(
            "layout",
            (size, loose),
            lambda: Layout(Storage.DENSE, np.arange(size), size - 1, loose=loose),
        )
    natural = np.arange(system.size)
    # before the pattern is made: that of a fine plate takes memory that its run needs
    if system.size >= WIDE:
        return Layout(Storage.SPARSE, natural, system.size - 1)
    small = system.size <= DENSE
    # of which bands are narrow, and plates turn
    full = any(terms.numbers_read(one.gather) > 0.0 for one in system.elastic)
    # with friction W is unsymmetric, which L D L^T is not; plates of full size turn, which factors
    # of `large` can
    whole = full or skew or not parts.storages
    # small systems are dense, without a search for a band
    pattern = None if small and whole else coupling(system, parts, pairs)
    order, width = (natural, system.size - 1) if small or pattern is None else band_order(pattern)
    # a band of a third of the size or more has nearly as many numbers as dense factors, in shorter
    # rows
    dense = small or (3 * width > system.size and system.size <= 4 * BAND)
    blocks = None if whole or pattern is None else in_blocks(pattern)
    loose = massless(system, parts)
    # band and blocks factor W alone, which is singular there; dense factors take W and the joints
    # in one
    if dense or (loose and system.size <= 8 * DENSE):
        found = Layout(Storage.DENSE, natural, width, loose=loose)
    else:
        large = loose or (width > BAND and width * system.size > SHORT * BAND**2)
        found = (
            Layout(Storage.SPARSE, natural, width) if large else Layout(Storage.BAND, order, width)
        )
    return found if loose or blocks is None or blocks.numbers > WORTH * found.numbers else blocks


def in_blocks(pattern: csr_array) -> Layout:
    """Blocks of a symmetric W with the pattern (n, n)."""
    n = pattern.shape[0]
    # a full diagonal, and no zeros that stand for entries: elimination may not meet a gap
    whole = csr_array(abs(pattern) + eye_array(n), dtype=float)
    whole.sort_indices()
    tree = supernodes.analyse(whole)
    upper = csr_array(triu(whole[tree.order][:, tree.order]))
    upper.sort_indices()
    width = int((upper.indices - np.repeat(np.arange(n), np.diff(upper.indptr))).max(initial=0))
    # unknowns are put into the order of the tree, so that its own is the natural one
    return Layout(Storage.BLOCKS, tree.order, width, tree._replace(order=np.arange(n)), upper)


def coupling(system: System, parts: Pieces, pairs: np.ndarray) -> csr_array:
    """Pattern of the iteration matrix (n, n)."""
    # sizes, so that entries of different sign do not cancel and vanish from the pattern
    pattern = abs(as_csr(system.mass))
    for A in (system.damping, system.stiffness):
        pattern = pattern if is_zero(A) else pattern + abs(as_csr(A))
    read = [local for local in map(terms.couplings, parts.storages) if local.size]
    if read:  # one product for all: sums of many patterns cost as many times the whole one
        cells = np.cumsum([0, *(local.shape[1] for local in read)])
        rows = np.concatenate(
            [
                np.tile(first + np.arange(one.shape[1]), len(one))
                for first, one in zip(cells, read, strict=False)
            ]
        )
        columns = np.concatenate([local.ravel() for local in read])
        incidence = csr_array(
            (np.ones(len(rows)), (rows, columns)), shape=(cells[-1], len(parts.offset))
        ) @ abs(parts.matrix)
        pattern = pattern + incidence.T @ incidence
    # only rows with second derivatives couple unknowns: linear joints leave the pattern as it is
    if len(pairs):
        probes = abs(as_csr(system.probes.matrix))
        (i, j) = pairs.T
        pattern = (
            pattern
            + probes.T @ csr_array((np.ones(len(i)), (i, j)), shape=(probes.shape[0],) * 2) @ probes
        )
        pattern = pattern + pattern.T  # that of pairs alone may be unsymmetric
    pattern = as_csr(pattern)
    pattern.eliminate_zeros()
    return pattern


def massless(system: System, parts: Pieces) -> bool:
    """Whether unknowns have neither mass nor elastic energy, as axes of thin rigid parts: only
    joints determine them.
    """
    read = distinct(
        np.concatenate([np.zeros(0, np.int64), *(terms.stiffened(one) for one in parts.storages)])
    )
    # what an elastic energy reads has a stiffness: no pivot of W is zero there
    held = distinct(nonzeros(rows_at(parts.matrix, read))[1])
    return prepare(system).find(
        "massless", (system.mass, system.metric, held.tobytes()), lambda: weightless(system, held)
    )


def weightless(system: System, held: np.ndarray) -> bool:
    """Whether some unknowns beside those that are held (h,) have no mass."""
    free = others(system.size, held)
    # nearly all systems: nothing is factored
    if not len(free):
        return False
    mass = system.mass if len(free) == system.size else csr_array(system.mass)[free][:, free]
    sizes = 1.0 / np.sqrt(system.metric.diagonal()[free])  # of positions and axes alike
    # pivots and no diagonal: combinations of unknowns may be without mass where none of them is
    found = saddle.factor(as_dense(mass) if len(free) <= saddle.SMALL else mass, scale=sizes)
    return found is None or bool(np.abs(found.factors.pivots()).min() <= LIGHT)
