"""Pieces of a report in HTML: facts, tables that sort, texts, pictures. Every text from outside is
escaped here.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from ..core.values.display import is_number

SHORT = 12  #: entries of a list that stand in one line
LONG = 2000  #: rows of a table, at most
KINDS = {".png": "image/png", ".gif": "image/gif", ".svg": "image/svg+xml"}


def section(title: str, *parts: str) -> str:
    """Parts under a heading; nothing without any."""
    inside = "\n".join(part for part in parts if part)
    return f"<section class=report><h2>{escape(title)}</h2>\n{inside}\n</section>" if inside else ""


def table(title: str, heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table whose columns sort when their heads are pressed."""
    if not rows:
        return ""
    left = f" ({LONG} of {len(rows)} rows)" if len(rows) > LONG else ""
    head = "".join(
        f'<th scope="col"><button type="button">{escape(text) or "&nbsp;"}</button></th>'
        for text in heads
    )
    body = "\n".join(f"<tr>{''.join(map(cell, row))}</tr>" for row in rows[:LONG])
    caption = f"<caption>{escape(title)}{left}</caption>" if title or left else ""
    return f"<div class=wide><table class=sorts>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"


def cell(value: object) -> str:
    """A value in a table; numbers to the right, with all digits where they sort."""
    if not is_number(value):
        return f"<td>{escape(shown(value))}</td>"
    return f'<td class=number data-value="{value!r}">{escape(shown(value))}</td>'


def shown(value: object) -> str:
    """A value as text: numbers with six digits, a dash for none."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {shown(one)}" for name, one in value.items()) or "-"
    if isinstance(value, list | tuple):
        return (
            "; ".join(map(shown, value[:SHORT]))
            + (f"; ... {len(value)} in all" if len(value) > SHORT else "")
            or "-"
        )
    if isinstance(value, bool):
        return "yes" if value else "no"
    return (
        "-" if value is None else f"{value + 0.0:.6g}" if isinstance(value, float) else str(value)
    )


def facts(title: str, values: Mapping[str, Any]) -> str:
    """Names beside values; nested ones are tables of their own behind it."""
    plain = {name: value for name, value in values.items() if not nested(value)}
    rows = "".join(
        f"<tr><th scope=row>{escape(words(name))}</th>{cell(value)}</tr>"
        for name, value in plain.items()
    )
    caption = f"<caption>{escape(words(title))}</caption>" if title else ""
    found = [f"<div class=wide><table>{caption}<tbody>{rows}</tbody></table></div>"] if rows else []
    for name, value in values.items():
        if nested(value):
            found.append(tree(f"{title}: {name}" if title else name, value))
    return "\n".join(found)


def nested(value: object) -> bool:
    """Whether a value of a report is a table of its own."""
    inside = (
        value.values() if isinstance(value, Mapping) else value if isinstance(value, list) else ()
    )
    return any(isinstance(one, Mapping) for one in inside) or (
        isinstance(value, Mapping) and len(value) > SHORT
    )


def tree(title: str, value: Any) -> str:
    """A list of objects, or objects by name, as a table; what is mixed, as facts."""
    pairs = list(enumerate(value) if isinstance(value, list) else value.items())
    if not pairs or not all(isinstance(one, Mapping) for _, one in pairs):
        return facts(title, {str(name): one for name, one in pairs})
    deep = dict.fromkeys(key for _, one in pairs for key, inside in one.items() if nested(inside))
    heads = [
        key for key in dict.fromkeys(key for _, one in pairs for key in one) if key not in deep
    ]
    named = isinstance(value, Mapping)
    rows = [
        [*([str(name)] if named else []), *(one.get(key) for key in heads)] for name, one in pairs
    ]
    found = table(words(title), [*([""] if named else []), *map(words, heads)], rows)
    called = [str(name) if named else str(next(iter(one.values()), "")) for name, one in pairs]
    for key in deep:
        inside = [
            tree(name, one[key])
            for name, (_, one) in zip(called, pairs, strict=True)
            if nested(one.get(key))
        ]
        found += f"<details><summary>{escape(words(f'{title}: {key}'))}</summary>{''.join(inside)}</details>"
    return found


def words(name: str) -> str:
    """The name of a value as words."""
    return str(name).replace("_", " ")


def notices(texts: Sequence[str]) -> str:
    """Warnings, as a list."""
    return (
        f"<ul class=notices>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>"
        if texts
        else ""
    )


def text(sentence: str) -> str:
    """A sentence."""
    return f"<p>{escape(sentence)}</p>"


def code(text: str) -> str:
    """A command, with a button that copies it."""
    return f'<div class=code><pre><code>{escape(text)}</code></pre><button type="button" class=copy>copy</button></div>'


def hidden(title: str, text: str) -> str:
    """A long text that opens when its title is pressed."""
    return f"<details><summary>{escape(title)}</summary><pre>{escape(text)}</pre></details>"


def picture(name: str, suffix: str, data: bytes) -> str:
    """A picture, whole in the page."""
    source = f"data:{KINDS[suffix]};base64,{base64.b64encode(data).decode('ascii')}"
    label = escape(name)
    return f'<figure class=picture><img alt="{label}" src="{source}"><figcaption>{label}</figcaption></figure>'
