"""Build the documentation site: `python docs/build.py` writes it to docs/_build/html; `--help` says what else.

The pages of this folder are laid out beside the gallery of examples and the reference of all public objects, both made here. The
examples are run for their pictures, tutorials for what they print. Sphinx then takes every warning for an error. Reading the site
needs no network.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SITE = ROOT / "docs" / "site"
sys.path.insert(0, str(SITE))

import gallery  # noqa: E402  all of the folder above
import reference_pages  # noqa: E402
import tutorials  # noqa: E402


def lay_out(source: Path, pictures: Path, executed: bool) -> None:
    """All pages of the site in one folder; those that the index does not name stand at its end."""
    shutil.copytree(
        ROOT / "docs",
        source,
        ignore=shutil.ignore_patterns("_build", "__pycache__", "*.py", "site"),
    )
    shutil.copytree(SITE, source, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
    for name in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        (source / name).write_text(text.replace("](docs/", "]("), encoding="utf-8")
    index = source / "index.md"
    text = index.read_text(encoding="utf-8")
    others = sorted(
        path.stem
        for path in source.glob("*.md")
        if path.stem not in ("index", "README", *text.split())
    )
    index.write_text(
        text.rstrip().removesuffix("```") + "\n".join([*others, "```\n"]), encoding="utf-8"
    )
    reference_pages.write(source / "api")
    gallery.write(source / "gallery", pictures)
    tutorials.write(source / "tutorials", executed)


def build(target: Path, drawn: bool) -> None:
    """The site in `target`/html, anew; pictures of examples are kept in `target`/pictures."""
    source, pictures = target / "source", target / "pictures"
    for name in gallery.names() if drawn else ():
        print(name, file=sys.stderr)
        gallery.draw(name, pictures / name.replace("/", "-"))
    for folder in (source, target / "html", target / "doctrees"):
        shutil.rmtree(folder, ignore_errors=True)
    target.mkdir(parents=True, exist_ok=True)
    lay_out(source, pictures, drawn)
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-q",
        "-W",
        "--keep-going",
        "-b",
        "html",
        "-d",
        target / "doctrees",
    ]
    if subprocess.run([*command, source, target / "html"], check=False).returncode:
        raise SystemExit("the site has warnings")


def main() -> None:
    parser = argparse.ArgumentParser(description="Build the documentation site.")
    parser.add_argument(
        "--out",
        type=Path,
        default=ROOT / "docs" / "_build",
        help="folder of the site (docs/_build)",
    )
    parser.add_argument(
        "--no-gallery",
        action="store_true",
        help="run neither examples nor tutorials; pictures stay",
    )
    options = parser.parse_args()
    build(options.out, not options.no_gallery)


if __name__ == "__main__":
    main()
