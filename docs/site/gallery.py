"""The gallery: a page for every example, with the pictures that running it makes.

Pictures stay in a folder beside the site, with the SHA-256 of each example's file, and are drawn again where that is another one.
"""

from __future__ import annotations

import hashlib
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import Scene

if TYPE_CHECKING:
    from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
#: scenes of the mechanism of another one, which has the pictures: finer meshes, ranges of parameters, bodies alone
VARIANTS = {
    "crank_slider": "crank_slider_coarse",
    "crank_slider_torque": "crank_slider_coarse",
    "crank_slider_young": "crank_slider_coarse",
    "pendulum_family": "double_pendulum",
    "sweep_pendulum": "double_pendulum",
    "parts/library": "parts/mobile",
}
#: kinds of examples, most special first, and words of scenes: an example is of the first kind with a word that its files say
KINDS = {
    "Parts": "type: part",
    "Reduced models over ranges of parameters": "training:",
    "Contact": "type: contact",
    "Control and plants": "inputs:|controllers:|type: control_torque",
    "Vibration and stability": "type: modes|type: campbell|type: buckling",
    "Plates and shells": "type: plate|type: shell",
    "Equilibria": "type: static",
    "Pendulums and mechanisms": "type: dynamic",
}
FIRST = ("picture.png", "animation.gif", "modes.png")  #: these pictures, then all others by name
HASH = "scene.sha256"
#: drawn by `results.rendering`, with a title of HEAD rows and a key of KEY columns [pixel]
SCENES = (
    "picture.png",
    "modes.png",
)
HEAD, KEY = 36, 192


def names() -> list[str]:
    """Examples with a page of their own, by their paths in the folder without the suffix."""
    found = [
        path.relative_to(EXAMPLES).with_suffix("").as_posix() for path in EXAMPLES.rglob("*.yaml")
    ]
    return sorted(set(found) - set(VARIANTS), key=lambda name: (name.count("/"), name))


def files(name: str) -> Iterator[Path]:
    """What belongs to the page of an example: its scene, its script, and those of its variants."""
    for one in (name, *(other for other, shown in VARIANTS.items() if shown == name)):
        yield from (
            path for suffix in (".yaml", ".py") if (path := EXAMPLES / f"{one}{suffix}").exists()
        )


def kind(name: str) -> str:
    """The kind of an example, which stands over it in the gallery."""
    text = "\n".join(
        path.read_text(encoding="utf-8") for path in files(name) if path.suffix == ".yaml"
    )
    return next(title for title, words in KINDS.items() if re.search(rf"(?m)\b({words})", text))


def draw(name: str, folder: Path) -> None:
    """Run an example and draw it into a folder, unless it holds the pictures of this very file."""
    path = EXAMPLES / f"{name}.yaml"
    wanted = hashlib.sha256(path.read_bytes()).hexdigest()
    if (folder / HASH).exists() and (folder / HASH).read_text() == wanted:
        return
    shutil.rmtree(folder, ignore_errors=True)
    try:
        studies.render(path, out=folder)
    except InputError:  # an analysis without shapes has figures alone
        studies.run(path, out=folder, force=True)
    (folder / HASH).write_text(wanted)


def pictures(folder: Path) -> list[Path]:
    """The pictures of an example in their order, none where it was not drawn."""
    found = [path for path in folder.glob("*.*") if path.suffix in (".png", ".gif")]
    return sorted(
        found,
        key=lambda path: (FIRST.index(path.name) if path.name in FIRST else len(FIRST), path.name),
    )


def cropped(path: Path) -> Image.Image:
    """What a picture shows on its white ground, without the title and the key of a scene."""
    from PIL import Image

    picture = Image.open(path).convert("RGB")
    inked = (np.asarray(picture) < 248).any(axis=2)
    if path.name in SCENES:
        inked[:HEAD] = inked[:, -KEY:] = False
    rows, columns = (np.flatnonzero(inked.any(axis=axis)) for axis in (1, 0))
    return picture.crop((columns[0], rows[0], columns[-1] + 1, rows[-1] + 1))


def title(name: str, scene: Scene) -> str:
    """An example's name in words."""
    return (scene.name or name).replace("_", " ").replace("-", " ").capitalize()


def page(name: str, scene: Scene, shown: list[str]) -> str:
    """The page of one example: what it is, its pictures, and its files."""
    command = (
        "fmbs render" if any(one.endswith(".gif") for one in shown) or not shown else "fmbs run"
    )
    parts = [
        f"# {title(name, scene)}",
        scene.description,
        *(f"![{Path(one).stem.replace('_', ' ')}]({one})" for one in shown),
    ]
    parts.append(f"```sh\n{command} examples/{name}.yaml\n```")
    for path in files(name):
        language = "python" if path.suffix == ".py" else "yaml"
        text = path.read_text(encoding="utf-8").rstrip()
        parts.append(
            f"## `examples/{path.relative_to(EXAMPLES).as_posix()}`\n\n`````{language}\n{text}\n`````"
        )
    return "\n\n".join(parts) + "\n"


def write(folder: Path, drawn: Path) -> None:
    """Pages of all examples and their index, by kinds; pictures where `drawn` has them."""
    folder.mkdir()
    cards: dict[str, list[str]] = {each: [] for each in reversed(KINDS)}
    pages = []
    for name in names():
        stem = name.replace("/", "-")
        scene = scenes.read(EXAMPLES / f"{name}.yaml")
        shown = []
        for path in pictures(drawn / stem):
            shutil.copy(path, folder / f"{stem}-{path.name}")
            shown.append(f"{stem}-{path.name}")
        (folder / f"{stem}.md").write_text(page(name, scene, shown), encoding="utf-8")
        image = ""
        if still := next((path for path in pictures(drawn / stem) if path.suffix == ".png"), None):
            card = cropped(still)
            card.thumbnail((520, 390))  # cards are 200 pixels wide, twice that on fine screens
            card.save(folder / f"{stem}-card.png")
            image = f"[![{title(name, scene)}]({stem}-card.png)]({stem}.md)\n\n"
        cards[kind(name)].append(
            f"````{{container}} card\n{image}[{title(name, scene)}]({stem}.md): {scene.description}\n````"
        )
        pages.append(stem)
    lead = "Every example is a file in `examples/`, which the tests run; `fmbs demo --copy` brings them with their meshes."
    toctree = "```{toctree}\n:hidden:\n\n" + "\n".join(pages) + "\n```"
    parts = [
        f"## {each}\n\n`````{{container}} gallery\n\n{chr(10).join(own)}\n`````"
        for each, own in cards.items()
    ]
    text = "\n\n".join(["# Gallery", lead, *parts, toctree])
    (folder / "index.md").write_text(text + "\n", encoding="utf-8")
