"""Sections that change along a line."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Annotated, Any

from ..core.errors import InputError, say
from ..core.storage.records import dataclass
from ..core.values.arguments import checked
from ..core.values.mappings import at_fractions, takes
from .sections import BeamSection, Given, Material, Offset, Pieces, Section


@dataclass(frozen=True)
@checked
class Tapered(Section):
    """A section that tapers: sections of one shape at fractions of the length, with dimensions that
    are linear in between.

    Of `matrices` and of `given` stiffness and mass are linear. Where mesh points lie at inner
    fractions, errors stay small.

    {shape: tapered, sections: {0: {shape: circular, diameter: 20 mm}, 1: {shape: circular, diameter: 10 mm}}}
    """

    sections: Annotated[Mapping[float, Section], at_fractions(takes(Section))]

    def __post_init__(self) -> None:
        if len(self.sections) < 2 or min(self.sections) != 0.0 or max(self.sections) != 1.0:
            raise InputError(
                say(
                    "section.sections",
                    "sections from the fraction 0 to 1 of the length",
                    sorted(self.sections),
                )
            )
        for one in self.sections.values():
            if one.stations:
                raise InputError(say("section.sections", "sections that are even", one))
        for a, b in itertools.pairwise(self.stations):
            blend(self.sections[a], self.sections[b], 0.5)

    @property
    def stations(self) -> tuple[float, ...]:
        return tuple(sorted(self.sections))

    def at(self, fraction: float) -> Section:
        a, b = next((a, b) for a, b in itertools.pairwise(self.stations) if fraction <= b)
        found: Section = blend(self.sections[a], self.sections[b], (fraction - a) / (b - a))
        return found

    @property
    def needs_material(self) -> bool:  # type: ignore[override]
        return any(one.needs_material for one in self.sections.values())

    @property
    def serves_cables(self) -> bool:  # type: ignore[override]
        return all(one.serves_cables for one in self.sections.values())

    @property
    def serves_beams(self) -> bool:  # type: ignore[override]
        return all(one.serves_beams for one in self.sections.values())

    @property
    def bends_alike(self) -> bool:
        return all(one.bends_alike for one in self.sections.values())

    def of_cable(self, material: Material | None) -> Given:
        """That of its middle."""
        return self.at(0.5).of_cable(material)

    def of_beam(
        self,
        material: Material | None,
        offset: Offset = None,
        pieces: Pieces = (),
        warping: bool = False,
    ) -> BeamSection:
        """That of its middle."""
        return self.at(0.5).of_beam(material, offset, pieces, warping)


def blend(one: Any, two: Any, share: float) -> Any:
    """(1 - share) one + share two of all numbers in two sections of one class; InputError where
    they differ otherwise.
    """
    if one == two:
        return one
    kind: Any = type(one)
    if is_dataclass(kind) and kind is type(two):
        return kind(
            **{
                f.name: blend(getattr(one, f.name), getattr(two, f.name), share)
                for f in fields(one)
            }
        )
    if isinstance(one, tuple) and isinstance(two, tuple) and len(one) == len(two):
        return tuple(blend(a, b, share) for a, b in zip(one, two, strict=True))
    if isinstance(one, float | int) and isinstance(two, float | int):
        return (1.0 - share) * one + share * two
    raise InputError(
        say("section.sections", "sections of one shape with the same points", f"{one} and {two}")
    )
