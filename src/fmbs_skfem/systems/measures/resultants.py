r"""The reaction of a joint with many rows, such as a held edge, as a force and a moment.

    rows  w_k . q_c(k) = const with forces f_k:      F = sum_k u_k f_k e_c(k),      M = sum_k (w_k . r - u_k p) x f_k e_c(k)

w_k . r = sum_b w_kb r_b are the coordinate vectors that a row reads, as they are now, u_k the part
of a translation among them, and p the place about which the moment is taken, fixed in space. F and
M do the work of all forces on rigid motions.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from ...core.storage.records import dataclass
from ...core.values.fields import AXES


@dataclass(frozen=True)
class Resultant:
    """What the k rows of a joint read, in their order, of which its force and moment are made."""

    arms: csr_array  #: (k c, q) rows w_k of all components
    components: np.ndarray  #: (k,) c(k)
    parts: np.ndarray  #: (k,) u_k
    place: np.ndarray  #: (c,) p from the origin of the scene [m]

    @property
    def numbers(self) -> tuple[float, ...]:
        """Place, then component and u of every row."""
        return (
            *self.place.tolist(),
            *np.column_stack([self.components, self.parts]).ravel().tolist(),
        )


def columns(name: str, dim: int) -> tuple[str, ...]:
    """`NAME_x` and so on of the force, `NAME_mx` and so on of the moment, in the plane `NAME_mz`."""
    return tuple(
        f"{name}_{word}" for word in (*AXES[:dim], *(("mz",) if dim == 2 else ("mx", "my", "mz")))
    )


def labels(place: np.ndarray) -> tuple[str, ...]:
    """What the columns are, for a moment about a place (c,) [m]: axes of forces, axes and place of
    moments.
    """
    dim = len(place)
    at = ", ".join(f"{value + 0.0:.4g}" for value in np.round(place, 9))
    moments = [f"moment about {axis} at ({at})" for axis in (AXES if dim == 3 else "z")]
    return (*(f"force along {axis}" for axis in AXES[:dim]), *moments)


def evaluate(
    numbers: tuple[float, ...], dim: int, arms: np.ndarray, forces: np.ndarray
) -> list[np.ndarray]:
    """Columns (s,) of force [N] and moment [N m] of forces (s, k) of the rows whose sensors read
    arms (s, k c) now.

        F = sum_k u_k f_k e_c(k),      M = sum_k (w_k . r - u_k p) x f_k e_c(k)

    `numbers` are those of `Resultant`: p (c,), then c(k) and u_k of every row.
    """
    place = np.array(numbers[:dim])
    rows = np.reshape(numbers[dim:], (-1, 2))
    each = np.zeros((*forces.shape, 3))
    k = np.arange(forces.shape[1])
    each[:, k, rows[:, 0].astype(int)] = forces
    apart = arms.reshape(*forces.shape, dim) - rows[:, 1, None] * place
    moment = np.cross(np.pad(apart, [(0, 0), (0, 0), (0, 3 - dim)]), each).sum(axis=1)
    force = (rows[:, 1, None] * each).sum(axis=1)
    return [*force.T[:dim], *moment.T[0 if dim == 3 else 2 :]]
