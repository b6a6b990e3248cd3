"""Build the documentation site: `python docs/build.py` writes it to docs/_build/html; `--help` says what else.

The pages of this folder are laid out beside the reference of the public objects of the package, which is made here. Sphinx then
takes every warning for an error. Reading the site needs no network.
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

import reference_pages  # noqa: E402  of the folder above


def lay_out(source: Path) -> None:
    """All pages of the site in one folder."""
    shutil.copytree(ROOT / "docs", source, ignore=shutil.ignore_patterns("_build", "__pycache__", "*.py", "site"))
    shutil.copytree(SITE, source, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
    reference_pages.write(source / "api")


def build(target: Path) -> None:
    """The site in `target`/html, anew."""
    source = target / "source"
    shutil.rmtree(target, ignore_errors=True)
    lay_out(source)
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "-d", target / "doctrees"]
    if subprocess.run([*command, source, target / "html"], check=False).returncode:
        raise SystemExit("the site has warnings")


def main() -> None:
    options = argparse.ArgumentParser(description="Build the documentation site.")
    options.add_argument("--out", type=Path, default=ROOT / "docs" / "_build", help="folder that is made anew (docs/_build)")
    build(options.parse_args().out)


if __name__ == "__main__":
    main()
