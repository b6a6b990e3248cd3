"""Tables as lines of text: no line is longer than the terminal, and neither a number nor a word is
ever cut.

Columns of numbers stand to the right, the first and those of sentences to the left. Where they do
not fit side by side, heads and long texts go on in further lines, broken between words; where that
is not enough, the table goes on below itself with the columns that are left, behind the first one
again. Only a single word that is longer than the terminal, as a path, is longer than its line.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

GAP, NARROW = 3, 2  #: blanks between columns, and where these do not fit
SENTENCE = 20  #: characters from which the text of a cell may be broken


def draw(
    title: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    width: int,
    names: bool,
    rule: str = "─",
) -> list[str]:
    """The lines of a table, its title first, without blanks at their ends; `names`: the first
    column is never broken.
    """
    cells = list(zip(*[columns, *rows], strict=True))
    right = [k > 0 and not any(map(breaks, column[1:])) for k, column in enumerate(cells)]
    natural = [max(map(length, column)) for column in cells]
    least = [
        min(own, smallest(column, names and not k))
        for k, (own, column) in enumerate(zip(natural, cells, strict=True))
    ]
    lines = fill(title, width)
    for shown, gap in blocks(natural, least, width):
        widths = stretch(
            [natural[k] for k in shown], [least[k] for k in shown], width - 1 - gap * len(shown)
        )
        at = list(zip(shown, widths, strict=True))
        head, *body = [
            merge(
                [[pad(part, w, right[k]) for part in wrap(cells[k][row], w)] for k, w in at],
                " " * gap,
                low=row == 0,
            )
            for row in range(1 + len(rows))
        ]
        ruled = [*head, " " + rule * (sum(widths) + gap * len(shown) - 1)] if any(columns) else []
        lines += ["", *ruled, *(line for row in body for line in row)]
    return [line.rstrip() for line in [*lines, ""]]


def smallest(column: Sequence[str], whole: bool) -> int:
    """The least width of a column: of the longest word of its head, and of what is not broken below
    it.
    """
    head, *cells = column
    words = [
        word
        for text in [head, *(cell for cell in cells if breaks(cell) and not whole)]
        for word in text.split()
    ]
    return max(
        map(length, [*words, *(cell for cell in cells if whole or not breaks(cell))]), default=0
    )


def breaks(cell: str) -> bool:
    """Whether the text of a cell may go on in another line."""
    return length(cell) > SENTENCE


def blocks(
    natural: Sequence[int], least: Sequence[int], width: int
) -> Iterator[tuple[list[int], int]]:
    """Columns that are shown side by side, and the blanks between them."""
    count = len(natural)
    for widths, gap in ((natural, GAP), (natural, NARROW), (least, NARROW)):
        if sum(widths) + gap * count + 1 <= width:
            yield list(range(count)), gap
            return
    shown = [0]
    for k in range(1, count):
        if len(shown) > 1 and sum(least[one] + NARROW for one in [*shown, k]) + 1 > width:
            yield shown, NARROW
            shown = [0]
        shown.append(k)
    yield shown, NARROW


def stretch(natural: Sequence[int], least: Sequence[int], room: int) -> list[int]:
    """Widths between the least and the natural ones that fill the room, the one that lacks most
    first.
    """
    widths = list(least)
    for _ in range(room - sum(widths)):
        lacks = [own - width for own, width in zip(natural, widths, strict=True)]
        if max(lacks) <= 0:
            break
        widths[lacks.index(max(lacks))] += 1
    return widths


def merge(cells: Sequence[list[str]], gap: str, low: bool) -> list[str]:
    """The lines of one row; `low`: its cells stand at the bottom where others have more lines."""
    height = max(map(len, cells))
    empty = [" " * length(cell[0]) for cell in cells]
    missing = [[blank] * (height - len(cell)) for blank, cell in zip(empty, cells, strict=True)]
    columns = [
        more + cell if low else cell + more for more, cell in zip(missing, cells, strict=True)
    ]
    return ["  " + gap.join(line) for line in zip(*columns, strict=True)]


def pad(text: str, width: int, right: bool) -> str:
    """A text with blanks to a width."""
    blanks = " " * (width - length(text))
    return blanks + text if right else text + blanks


def fill(text: str, width: int) -> list[str]:
    """A text in lines that end between words; its own lines stay."""
    return [part for line in text.splitlines() for part in wrap(line, width)] or [""]


def wrap(text: str, width: int) -> list[str]:
    """One line of text as lines of a width, at least one; the indent of a line is that of those it
    goes on in.
    """
    if length(text) <= width:
        return [text]
    indent = text[: len(text) - len(text.lstrip())]
    return textwrap.wrap(
        text,
        max(width, 1),
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    ) or [""]


def length(text: str) -> int:
    """Characters of a terminal that a text takes: letters of some alphabets take two."""
    if text.isascii():
        return len(text)
    from rich.cells import cell_len

    return cell_len(text)
