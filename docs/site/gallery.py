"""The gallery: a page for every example, with the pictures that running it makes.

Pictures stay in a folder beside the site, with the SHA-256 of each example's file, and are drawn again where that is another one.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator
from pathlib import Path

from fmbs_skfem import scenes, studies
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.scenes import Scene

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
FIRST = ("picture.png", "animation.gif", "modes.png")  #: these pictures, then all others by name
HASH = "scene.sha256"


def names() -> list[str]:
    """Examples with a page of their own, by their paths in the folder without the suffix."""
    found = [path.relative_to(EXAMPLES).with_suffix("").as_posix() for path in EXAMPLES.rglob("*.yaml")]
    return sorted(set(found) - set(VARIANTS), key=lambda name: (name.count("/"), name))


def files(name: str) -> Iterator[Path]:
    """What belongs to the page of an example: its scene, its script, and those of its variants."""
    for one in (name, *(other for other, shown in VARIANTS.items() if shown == name)):
        yield from (path for suffix in (".yaml", ".py") if (path := EXAMPLES / f"{one}{suffix}").exists())


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
    return sorted(found, key=lambda path: (FIRST.index(path.name) if path.name in FIRST else len(FIRST), path.name))


def title(name: str, scene: Scene) -> str:
    """An example's name in words."""
    return (scene.name or name).replace("_", " ").replace("-", " ").capitalize()


def page(name: str, scene: Scene, shown: list[str]) -> str:
    """The page of one example: what it is, its pictures, and its files."""
    command = "fmbs render" if any(one.endswith(".gif") for one in shown) or not shown else "fmbs run"
    parts = [f"# {title(name, scene)}", scene.description, *(f"![{Path(one).stem.replace('_', ' ')}]({one})" for one in shown)]
    parts.append(f"```sh\n{command} examples/{name}.yaml\n```")
    for path in files(name):
        language = "python" if path.suffix == ".py" else "yaml"
        text = path.read_text(encoding="utf-8").rstrip()
        parts.append(f"## `examples/{path.relative_to(EXAMPLES).as_posix()}`\n\n`````{language}\n{text}\n`````")
    return "\n\n".join(parts) + "\n"


def write(folder: Path, drawn: Path) -> None:
    """Pages of all examples and their index; pictures where `drawn` has them."""
    folder.mkdir()
    cards, pages = [], []
    for name in names():
        stem = name.replace("/", "-")
        scene = scenes.read(EXAMPLES / f"{name}.yaml")
        shown = []
        for path in pictures(drawn / stem):
            shutil.copy(path, folder / f"{stem}-{path.name}")
            shown.append(f"{stem}-{path.name}")
        (folder / f"{stem}.md").write_text(page(name, scene, shown), encoding="utf-8")
        still = next((one for one in shown if one.endswith(".png")), None)
        image = f"[![{title(name, scene)}]({still})]({stem}.md)\n\n" if still else ""
        cards.append(f"````{{container}} card\n{image}[{title(name, scene)}]({stem}.md): {scene.description}\n````")
        pages.append(stem)
    lead = "Every example is a file in `examples/`, which the tests run; `fmbs demo --copy` brings them with their meshes."
    toctree = "```{toctree}\n:hidden:\n\n" + "\n".join(pages) + "\n```"
    text = "\n\n".join(["# Gallery", lead, "`````{container} gallery", *cards, "`````", toctree])
    (folder / "index.md").write_text(text + "\n", encoding="utf-8")
