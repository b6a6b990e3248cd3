"""Colours that stay apart for colour-blind readers (Okabe and Ito,
https://jfly.uni-koeln.de/color/), dark ones first.
"""

from __future__ import annotations

BLACK, BLUE, VERMILLION, GREEN = "#000000", "#0072B2", "#D55E00", "#009E73"
ORANGE, PURPLE, SKY, GREY = "#E69F00", "#CC79A7", "#56B4E9", "#7F7F7F"

#: readable on white, in the order in which they are handed out
CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, GREY)


def colour(index: int) -> str:
    """The colour of item `index`; starts again after the last."""
    return CYCLE[index % len(CYCLE)]
