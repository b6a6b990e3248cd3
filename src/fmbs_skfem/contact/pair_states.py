"""What contacts of beams do in given states: gaps, normal forces, sliding."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..core.compiling.structs import Cube, Matrix, opener, routine
from ..systems.forces.on_rows import Place
from .curves import longest
from .law import UNKNOWN, size
from .pairs import NODE, ROOM, BeamContacts, PairsRecord, away, find, follow, press, record_of


@routine
def measure(table: Any, _: Any) -> int:
    """out (s, t, 3 + c) = gap, normal force, speed of sliding, normal of all nodes for samples of y
    and y' (s, f).
    """
    S = samples_of(table)
    F = S.record
    dim = S.record.dim
    new = np.zeros(NODE)
    w = np.zeros((ROOM, 3))
    forces_there = np.empty(8 * dim)
    new[0], new[1], new[4], new[5] = UNKNOWN, 1.0, -1.0, -1.0
    for i in range(len(S.y)):
        far = longest(S.y[i], 2 * dim * (len(F.spans) + 1), len(F.others), dim)
        for k in range(len(F.spans) + 1):
            w[0, 0] = np.inf  # where the node meets nothing at all
            gap, p, q, _ = find(F, k, S.y[i], (far, np.inf), w)
            S.out[i, k, 0] = away(F, w) if F.itself else gap
            if gap < 0.0:
                follow(F, S.v[i], S.y[i], p, q, w)
                S.out[i, k, 1] = press(F, k, S.y[i], new, p, q, w, forces_there)
                S.out[i, k, 2] = size(w[8], dim)
                for c in range(dim):
                    S.out[i, k, 3 + c] = w[6, c]
    return 0


class PairSamples(NamedTuple):
    """Rows of a contact over time."""

    record: PairsRecord
    y: Matrix
    v: Matrix
    out: Cube


samples_of = opener(PairSamples)


def measures(term: BeamContacts, y: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Gap [m], normal force [N], speed of sliding [m/s], and normal of nodes (s, t, 3 + c).

    The gap is infinite where it is that of other nodes; of a beam to itself it is that to the
    nearest place between the limits.
    """
    y, v = map(np.ascontiguousarray, (y, v))
    samples = PairSamples(
        record_of(term, Place(0, 0, 0)), y, v, np.zeros((len(y), len(term), 3 + term.dim))
    )
    measure(samples)
    return samples.out


def gaps_of(term: BeamContacts, y: np.ndarray) -> np.ndarray:
    """Gaps (t,) of all nodes with rows y (f,)."""
    return np.asarray(measures(term, y[None], 0.0 * y[None])[0, :, 0])
