"""From the annotations of a study to the arguments, options and help of its command; see
`studies.options`.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args, get_type_hints

import click

from ..studies.options import Argument, Option

FILE = click.Path(path_type=Path)
COMMON = (
    click.Option(["--json"], is_flag=True, help="Print one JSON object on stdout."),
    click.Option(["--strict"], is_flag=True, help="Treat warnings as errors."),
    click.Option(
        ["--allow-extensions"],
        is_flag=True,
        help="Run the Python files that a scene names: read them first.",
    ),
    click.Option(["--debug"], is_flag=True, help="Show the Python traceback of an error."),
)


def parameters(study: Callable[..., Any], into: str = "") -> list[click.Parameter]:
    """The arguments and options of the command of a study; `into` says where its results go without
    --out.
    """
    found = [
        make_parameter(name, note, kinds, default)
        for name, note, kinds, default in read_annotations(study)
    ]
    for one in found:
        if isinstance(one, click.Option) and one.name == "out" and into:
            one.show_default = into
    return [*found, *COMMON]


def read_annotations(
    study: Callable[..., Any],
) -> Iterator[tuple[str, Argument | Option, set[Any], Any]]:
    """Keyword, note, types and default of everything of a study that its annotations describe."""
    for parameter in inspect.signature(study).parameters.values():
        hints = {parameter.name: parameter.annotation}
        default = parameter.default
        if parameter.kind is inspect.Parameter.VAR_KEYWORD:
            hints = get_type_hints(get_args(parameter.annotation)[0], include_extras=True)
            default = None
        for name, hint in hints.items():
            kind, *notes = get_args(hint) or (hint,)
            for note in notes:
                if isinstance(note, Argument | Option):
                    yield name, note, {kind, *get_args(kind)}, default


def make_parameter(
    name: str, note: Argument | Option, kinds: set[Any], default: Any
) -> click.Parameter:
    """The parameter of click for a keyword."""
    if isinstance(note, Argument):
        return click.Argument([name], metavar=note.value, type=FILE)
    word = "--" + (note.name or name).replace("_", "-")
    common: dict[str, Any] = {"help": note.help, "metavar": note.value or None}
    if note.read is not None:
        return click.Option([word, name], multiple=True, callback=reader(note.read), **common)
    shown = default not in (None, False, math.inf, "")
    if kinds == {bool}:
        return click.Option([f"{word}/--no-{word[2:]}", name] if default else [word, name], is_flag=True, **common,
                            default=bool(default), show_default=shown)  # fmt: skip
    return click.Option(
        [word, name], default=default, show_default=shown, **choose_type(note, kinds), **common
    )


def choose_type(note: Option, kinds: set[Any]) -> dict[str, Any]:
    """Type, and check, of the value of an option."""
    if callable(note.choices):
        return {"type": str, "callback": chooser(note.choices)}
    if note.choices:
        return {"type": click.Choice(list(note.choices))}
    kind = next((one for one in (Path, str, float, int) if one in kinds), str)
    if note.least is not None:
        ranged: Any = click.FloatRange if kind is float else click.IntRange
        return {"type": ranged(note.least, note.most, min_open=note.above)}
    return {"type": FILE if kind is Path else kind}


def reader(read: Callable[[tuple[str, ...]], Any]) -> Callable[..., Any]:
    """A check of click that reads the texts of an option given several times."""

    def check(context: click.Context, option: click.Parameter, texts: tuple[str, ...]) -> Any:
        try:
            return read(texts)
        except ValueError as problem:
            raise click.BadParameter(str(problem), context, option) from problem

    return check


def chooser(known: Callable[[], Any]) -> Callable[..., Any]:
    """A check of click for a word among those that are known when it is given."""

    def check(context: click.Context, option: click.Parameter, word: str | None) -> str | None:
        if word is not None and word not in known():
            raise click.BadParameter(
                f"expected one of {', '.join(known())}, got '{word}'", context, option
            )
        return word

    return check


def explain(study: Callable[..., Any]) -> str:
    """The docstring of a study with its keywords as they are written on the command line, without
    what it says of Python.
    """
    words = {
        name: "--" + (note.name or name).replace("_", "-")
        for name, note, *_ in read_annotations(study)
        if isinstance(note, Option)
    }
    text = (inspect.getdoc(study) or "").partition("\n\nIn Python ")[0]
    return re.sub(r"`(\w+)`", lambda found: words.get(found[1], found[0]), text)


def source(study: Callable[..., Any]) -> str:
    """The keyword of the argument of a study; empty where it has none."""
    return next(
        (name for name, note, *_ in read_annotations(study) if isinstance(note, Argument)), ""
    )
