r"""Loads along lines: forces and moments per length of the reference, from s to s.

    Q = s(t) int f(s) N^T ds            f of fixed directions, or turning with the section

Integrals are sums over Gauss points between ends of cells and of the load; what turns acts there.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import numpy as np

from ...bodies.body import Body, arc_lengths
from ...core.algebra.linalg import evenly
from ...core.errors import InputError, say
from ...core.storage.records import dataclass
from ...core.values.fields import Length, quantity
from ...core.values.problems import Problem
from ...shapes import line
from .. import fields
from ..connections.constraint_functions import basis, point
from ..connections.edges import SHOWN
from ..places import At, Draft, Ground, directions, vector
from .loads import ALONG, Load, add_follower, add_following_moment, add_moment, push_whole, where

POINTS = (
    4  #: of a cell: a cubic spline times what is linear is of degree 4, along curved lines of more
)


@dataclass(frozen=True)
class LineLoad(Load):
    """A force per length of the reference of a cable or beam, and a moment per length of a beam, of a
    planar cable about z, between two lengths along it, by default its ends.

        Q = history(t) int N^T force ds

    The force goes linearly to `end_force`, where that is given. As `follower` force and moment turn
    with the section: along the directors of a beam, [tangential, normal] of a planar cable.

    {type: line_load, body: beam, force: [0, 0, -20 N/m], start: 0.5 m, end: 1.5 m}
    """

    name: str
    body: fields.BodyName
    force: Annotated[Ground | None, fields.vector("N/m")] = None
    end_force: Annotated[Ground | None, fields.vector("N/m")] = None
    moment: Annotated[float | Ground | None, fields.spin("N")] = None
    start: Annotated[float, quantity("m", ">= 0")] = 0.0
    end: Length | None = None
    follower: bool = False
    history: fields.History | None = None
    strengths = ("force", "end_force", "moment")

    def problems(self, dim: int) -> Iterator[tuple[str, Problem]]:
        if self.end is not None and self.end <= self.start:
            yield "end", Problem(f"more than the start, {self.start:g} m", f"{self.end:g} m")
        if self.end_force is not None and self.force is None:
            yield "end_force", Problem("a `force` at the start", "none", "write zeros")

    def push(self, draft: Draft) -> None:
        name = where(self)
        layout = draft.layout
        part = layout.body(name, At(self.body))
        if not isinstance(part.space, line.BSpline | line.Hermite):
            remedy = "plates and solids have `edge_load`, `surface_load`, `pressure`"
            raise InputError(say(name, "a cable or beam", f"'{self.body}'", remedy))
        s, weights, share = self.points(part)
        places = [At(self.body, float(one)) for one in s]
        sizes = self.sizes(name, layout.dim, directions(part, 0.0), share)
        if self.moment is not None:
            self.push_moments(draft, part, places, weights)
        if self.follower:
            signal = draft.signal(self.history)
            for at, size in zip(places, weights[:, None] * sizes, strict=True):
                add_follower(name, draft, at, size, signal)
        else:
            rows = np.vstack([layout.row(part, at.place).toarray() for at in places])
            push_whole(self, draft, rows.T @ (weights[:, None] * sizes))
        for k in evenly(0, len(s) - 1, SHOWN):
            axes = basis(name, layout, places[k])[1][: sizes.shape[1]]
            aim = sizes[k] @ axes if self.follower else sizes[k]
            point(name, draft, "force", places[k], aim, places[k] if self.follower else None)

    def points(self, part: Body) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gauss points s (p,) [m], their weights (p,) [m], and how far they are from start to end
        (p,).
        """
        parameters, arc = arc_lengths(part)
        end = float(arc[-1]) if self.end is None else self.end
        if not self.start < end <= arc[-1] * (1.0 + ALONG):
            expected = (
                f"lengths along '{self.body}' up to {arc[-1]:.6g} m, the end behind the start"
            )
            raise InputError(say(where(self), expected, f"{self.start:.6g} m to {end:.6g} m"))
        cells = np.interp(line.breaks(part.space), parameters, arc)
        inside = cells[(cells > self.start) & (cells < end)]
        edges = np.unique([self.start, *inside, min(end, float(arc[-1]))])
        x, w = np.polynomial.legendre.leggauss(POINTS)
        half = 0.5 * np.diff(edges)
        s = (edges[:-1, None] + half[:, None] * (1.0 + x)).ravel()
        return s, np.outer(half, w).ravel(), (s - self.start) / (end - self.start)

    def sizes(self, name: str, dim: int, axes: int, share: np.ndarray) -> np.ndarray:
        """The force (p, c) [N/m] at points that far from start to end."""
        count = dim if dim == 2 or axes == 3 or not self.follower else 1
        first = np.zeros(count) if self.force is None else vector(name, self.force, count)
        last = first if self.end_force is None else vector(name, self.end_force, count)
        return np.asarray(first + share[:, None] * (last - first))

    def push_moments(self, draft: Draft, part: Body, places: list[At], weights: np.ndarray) -> None:
        """Add the moments; InputError of a cable in space, which has no torsion."""
        name = where(self)
        dim = draft.layout.dim
        if dim == 3 and part.directors is None:
            remedy = "cables carry no torsion: take `type: beam`"
            raise InputError(say(f"{name}.moment", "none on a cable in space", "one", remedy))
        moment = vector(name, np.atleast_1d(np.array(self.moment)), 3 if dim == 3 else 1)
        signal = draft.signal(self.history)
        for at, weight in zip(places, weights, strict=True):
            if self.follower and dim == 3:
                add_following_moment(name, draft, at, weight * moment, signal)
            else:
                add_moment(name, draft, at, weight * moment, signal)
