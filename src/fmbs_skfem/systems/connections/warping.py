r"""Joints that hold the warping of beams, or pass it on.

    kappa_1 = 1/2 (d_3 . d_2' - d_2 . d_3') = kappa_1 of the reference       held: the section stays plane
    kappa_1 of one = kappa_1 of the other                                    beams that go straight on

The warping of a section is omega kappa_1: at a free end the bimoment is none.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from scipy.sparse import csr_array, vstack

from ...bodies.body import locate
from ...bodies.laws import Law
from ...core.algebra.linalg import as_csr
from ...core.notices import notify
from ..measures.beam_sections import vectors
from ..places import At, Draft
from .constraint_functions import where

Warping: TypeAlias = Annotated[
    Literal["held", "free"], "of beams with `warping`: the section stays plane there, or not"
]
STRAIGHT = 0.1  #: angle between lines that go straight on [rad]; of a larger one a part of the bimoment bends
ALIKE = 1e-3  #: part by which sections that are one may differ


def warps(draft: Draft, name: str, at: Any) -> bool:
    """Whether a place belongs to a beam that warps."""
    part = draft.layout.body(name, at) if isinstance(at, At) else None
    return part is not None and part.cells is not None and part.cells.law is Law.WARPED_BEAM


def restrain_warping(joint: Any, draft: Draft, at: At, to: Any) -> None:
    """Rows behind those of `tied` that hold the warping of the beams that a joint clamps or welds, or
    pass it on where two of one section go straight on; none where the joint leaves it free.
    """
    name = where(joint)
    ends = [end for end in (at, to) if warps(draft, name, end)]
    if joint.warping == "free" or not ends:
        return
    found = [twist(draft, name, end, to is None) for end in ends]
    if len(ends) == 2 and go_on(draft, name, at, to):
        (one, start), (other, theirs) = found
        opposite = [(-factor, signal, i, j) for factor, signal, i, j in other]
        found = [([*one, *opposite], start - theirs)]
    for k, (terms, start) in enumerate(found):
        word = "warping" if len(found) == 1 else f"warping {k + 1}"
        draft.constraints.row(joint.name, word, *terms, (-start, -1, -1, -1))
    # a bimoment is neither a force nor a moment
    own = draft.constraints.resultants[joint.name]
    more = len(found)
    draft.constraints.resultants[joint.name] = replace(
        own,
        arms=as_csr(vstack([own.arms, csr_array((3 * more, own.arms.shape[1]))])),
        components=np.append(own.components, np.zeros(more, own.components.dtype)),
        parts=np.append(own.parts, np.zeros(more)),
    )


def twist(
    draft: Draft, name: str, at: At, still: bool
) -> tuple[list[tuple[float, int, int, int]], float]:
    """Terms of kappa_1 at a place, and its value in the reference [1/m]; linear ones where the
    directors there stand `still`.
    """
    part = draft.layout.body(name, at)
    xi = np.array([float(locate(part, at.place))])  # type: ignore[arg-type]
    rows = vectors(part, xi)
    start = np.asarray(rows @ part.reference)
    first = draft.probes.add(draft.layout.spread(part, rows))
    of = lambda vector, c: first + 3 * vector + c  # noqa: E731
    terms = []
    value = 0.0
    for d, slope, sign in ((3, 6, 0.5), (2, 7, -0.5)):
        value += sign * float(start[d] @ start[slope])
        for c in range(3):
            linear = (sign * float(start[d, c]), -1, of(slope, c), -1)
            terms.append(linear if still else (sign, -1, of(slope, c), of(d, c)))
    return terms, value


def go_on(draft: Draft, name: str, at: At, to: At) -> bool:
    """Whether the beam at one place goes straight on in that at another one: its warping is the
    same there. A notice where only the line does.
    """
    layout = draft.layout
    a, b = (layout.reference(name, end, 1) for end in (at, to))
    if np.linalg.norm(np.cross(a, b)) > STRAIGHT:
        return False
    own, other = (section_at(draft, name, end) for end in (at, to))
    size = np.sqrt(np.abs(np.diag(own)))
    along = abs(float(layout.reference(name, at, 2) @ layout.reference(name, to, 2)))
    alike = bool((np.abs(own - other) <= ALIKE * np.outer(size, size)).all())
    if not alike or along < 1.0 - STRAIGHT:
        text = "are in line, but not of one section with one direction: its warping is held in both"
        notify(f"{name}: {at} and {to} {text}, as by a plate between them; 'warping: free' if not")
        return False
    return True


def section_at(draft: Draft, name: str, at: At) -> np.ndarray:
    """The stiffness (8, 8) of a beam at a place."""
    part = draft.layout.body(name, at)
    assert part.profile is not None
    xi = np.array([float(locate(part, at.place))])  # type: ignore[arg-type]
    return np.asarray(part.profile.at(xi)[0][0])
