"""Arrays that are given: finite numbers of the shape that is wanted, or a message that says what is
wrong with them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, say
from .problems import shown


def finite(
    x: ArrayLike, where: str, wanted: str, *shape: int | None, remedy: str = "", empty: bool = False
) -> NDArray[np.float64]:
    """x as finite 64-bit numbers with an axis for every length of the shape, None for any;
    InputError says what was `wanted`.

    Arrays without numbers are refused unless they may be `empty`.
    """
    try:
        array = np.asarray(x, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(say(where, wanted, shown(x), remedy)) from None
    fits = array.ndim == len(shape) and all(
        own in (None, length) for own, length in zip(shape, array.shape, strict=True)
    )
    if not fits or not (array.size or empty or 0 in shape):
        raise InputError(say(where, wanted, f"shape {array.shape}", remedy))
    if not np.isfinite(array).all():
        columns = np.isfinite(array.reshape(-1, array.shape[-1])).all(axis=0)
        raise InputError(
            say(where, wanted, f"NaN or infinity in column {int(columns.argmin())}", remedy)
        )
    return array
