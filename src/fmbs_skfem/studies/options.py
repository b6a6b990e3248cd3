"""Options of studies, declared once: a keyword of a Python function, which is an option of the
command line.

    def run(source: SceneOrModel, *, duration: Duration = None, **shared: Unpack[Shared]) -> "Run": ...
    Duration = Annotated[float | None, Option("Duration of the motion, ...", "SECONDS")]          --duration SECONDS

`cli.options` makes the options of a command of the annotations of its function; its help is the
docstring.
"""

from __future__ import annotations

import functools
import inspect
import math
import re
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    TypeAlias,
    TypedDict,
    TypeVar,
    cast,
    get_args,
    get_type_hints,
)

from ..core.errors import InputError, closest, say
from ..core.storage.records import dataclass
from ..core.values.problems import shown
from .job import Listener

if TYPE_CHECKING:
    from .job import Source

F = TypeVar("F", bound=Callable[..., Any])
Amount: TypeAlias = str | float
#: low, high, and "log"
Ranges: TypeAlias = Mapping[str, tuple[Amount, Amount] | tuple[Amount, Amount, str]]


@dataclass(frozen=True)
class Argument:
    """What a study is of: the argument of its command, shown as `value`."""

    value: str

    def __repr__(self) -> str:
        return repr(self.value)


@dataclass(frozen=True)
class Option:
    """What a keyword of a study means, and how it is written on the command line."""

    help: str
    value: str = ""  #: what stands for its value in the help, with the unit of a number; the type where it is empty
    name: str = ""  #: of the option, where that is not the keyword
    least: float | None = None  #: the smallest number that it may be
    most: float | None = None
    above: bool = False  #: `least` itself is none of them
    #: what it may be; a function where that needs imports
    choices: Collection[str] | Callable[[], Collection[str]] = ()
    #: of an option that may be given several times: its texts as a value
    read: Callable[[tuple[str, ...]], Any] | None = None

    def __repr__(self) -> str:
        return repr(self.help)


def study(function: F) -> F:
    """A study whose keywords are what its annotations and options say, as the command line has it;
    InputError names another one.
    """

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        from ..core.values.arguments import is_default

        known = keywords(function)
        if unknown := [name for name in named if name not in known]:
            wrong = f"{function.__name__}() got an unexpected keyword argument '{unknown[0]}'"
            raise TypeError(wrong + closest(unknown[0], known))
        for name, value in (*zip(known, given, strict=False), *named.items()):
            if name in known:
                kind, option, default = known[name]
                if not is_default(value, default):
                    require_option(f"{function.__name__}: {name}", value, kind, option)
        return function(*given, **named)

    return cast(F, call)


@functools.cache
def keywords(function: Callable[..., Any]) -> dict[str, tuple[Any, Option | None, Any]]:
    """Kind, option and default of the keywords of a study by name, those that it shares with others
    last.
    """
    found = dict[str, tuple[Any, Any]]()
    for one in inspect.signature(function).parameters.values():
        if one.kind is one.VAR_KEYWORD:
            shared = get_type_hints(get_args(one.annotation)[0], include_extras=True)
            found |= {name: (hint, one.empty) for name, hint in shared.items()}
        else:
            found[one.name] = one.annotation, one.default
    return {
        name: (
            hint,
            next(
                (note for note in getattr(hint, "__metadata__", ()) if isinstance(note, Option)),
                None,
            ),
            default,
        )
        for name, (hint, default) in found.items()
    }


def require_option(where: str, value: Any, kind: Any, option: Option | None) -> None:
    """InputError where a value is not of a kind, or not what its option may be."""
    from ..core.values import arguments

    arguments.require(where, value, kind)
    if option is None or value is None:
        return
    choices = option.choices() if callable(option.choices) else option.choices
    if choices and value not in choices:
        raise InputError(say(where, f"one of {', '.join(choices)}", shown(value)))
    least = -math.inf if option.least is None else option.least
    most = math.inf if option.most is None else option.most
    if isinstance(value, int | float) and not (
        least < value <= most or (value == least and not option.above)
    ):
        span = f"above {least:g}" if option.above else f"from {least:g}"
        raise InputError(
            say(
                where,
                f"a number {span} to {most:g}" if most < math.inf else f"a number {span} on",
                shown(value),
            )
        )


def changes(texts: tuple[str, ...]) -> dict[str, str]:
    """NAME=VALUE pairs; ValueError for another form, and for a name that is there twice."""
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = map(str.strip, text.partition("="))
        if not (name and equals):
            raise ValueError(f"expected NAME=VALUE, got '{text}'")
        require_new(name, found)
        found[name] = value
    return found


def require_new(name: str, found: Collection[str]) -> None:
    """ValueError for a name that was given before: of two values none is the one that is meant."""
    if name in found:
        raise ValueError(f"expected every name once, got '{name}' twice; delete one")


def ranges(texts: tuple[str, ...]) -> Ranges:
    """NAME=LOW:HIGH or NAME=LOW:HIGH:log; ValueError for another form, and for a name that is there
    twice.
    """
    found: dict[str, Any] = {}
    for text in texts:
        match = re.fullmatch(r"\s*(\w+)\s*=([^:]+):([^:]+?)(:\s*(?:log|linear)\s*)?", text)
        if match is None:
            raise ValueError(f"expected NAME=LOW:HIGH or NAME=LOW:HIGH:log, got '{text}'")
        require_new(match[1], found)
        found[match[1]] = (
            match[2].strip(),
            match[3].strip(),
            *(["log"] if "log" in (match[4] or "") else []),
        )
    return found


def statistics(texts: tuple[str, ...]) -> Mapping[str, list[str]]:
    """OUTPUT:STATISTIC pairs as statistics by output; ValueError for another form."""
    found: dict[str, list[str]] = {}
    for text in texts:
        output, _, kind = map(str.strip, text.rpartition(":"))
        if not (output and kind):
            raise ValueError(f"expected OUTPUT:STATISTIC, as in tip_y:rms, got '{text}'")
        found.setdefault(output, []).append(kind)
    return found


def examples() -> Collection[str]:
    """Names of the example scenes that travel with the package."""
    from ..scenes.examples import names

    return names()


class OutputOptions(TypedDict, total=False):
    """Options that all studies have."""

    out: Annotated[str | Path | None, Option("Folder for the results.", "DIR")]
    force: Annotated[bool, Option("Overwrite the results of another run in the folder.")]
    listener: Listener
    states: bool  #: whether a run keeps all states of its motion, for `Run.trajectory`, or few where nothing reads them
    extensions: str | None  #: consent to run the Python files of scenes, see `core.consents`


class ValueOptions(OutputOptions, total=False):
    """Options of studies whose source has parameters."""

    parameters: Annotated[
        Mapping[str, Amount] | None,
        Option(
            "Replace a parameter: a number in SI units, or with its unit (E=2 GPa).",
            "NAME=VALUE",
            "set",
            read=changes,
        ),
    ]


class Shared(ValueOptions, total=False):
    """Options of studies of scenes."""

    allow_outside: Annotated[bool, Option("Permit meshes outside the scene's project folder.")]
    accuracy: Annotated[
        str | float | None,
        Option(
            "Errors that outputs may have: a part of their ranges (1e-3, 0.1 %), a quantity (1 mm), or by output "
            "(C=1 mm, motor=2 %). Step and cells that the scene leaves open are found for it.",
            "ERROR",
        ),
    ]
    repair: Annotated[bool, Option("Merge nodes of meshes that are at one place.")]


class JobOptions(Shared, total=False):
    """All that a `Job` is asked for: what studies share, and what only some of them take."""

    duration: float | None
    plots: bool
    units: bool
    checkpoint: float | None
    time_limit: float
    check: bool


SceneSource = Annotated["Source", Argument("SCENE")]
ViewSource = Annotated["Source", Argument("SOURCE")]
ModelFile = Annotated[str | Path, Argument("FILE")]
Duration = Annotated[
    float | None,
    Option("Duration of the motion, instead of that of the scene or of the training.", "SECONDS"),
]
Step = Annotated[
    float | None,
    Option("Step of a saved reduced model, instead of that of its training.", "SECONDS"),
]
Plots = Annotated[bool, Option("Draw the figures.")]
Units = Annotated[
    bool, Option("Write the SI unit of every column into the head of outputs.csv: `tip_x [m]`.")
]
Picture = Annotated[
    bool,
    Option(
        "Draw a saved reduced model into picture.png: the centre lines and surfaces of the bodies behind it."
    ),
]
Html = Annotated[bool, Option("Write the motion as a page for the browser, page.html.")]
TimeLimit = Annotated[
    float,
    Option(
        "Stop a motion after so many seconds of integration, with a checkpoint (exit code 6).",
        "SECONDS",
        least=0.0,
        above=True,
    ),
]
