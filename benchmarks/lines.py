"""Lines of code of every folder of the package: without docstrings, comments and blank lines.

    python benchmarks/lines.py [FOLDER]

A line counts if a token of code stands on it, or a string goes over it that is no docstring. The
engine is what runs without scenes, files, commands and figures.
"""

from __future__ import annotations

import ast
import io
import sys
import tokenize
from collections import Counter
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "src" / "fmbs_skfem"
ENGINE = {"core", "shapes", "bodies", "systems", "dynamics", "reduction"}
LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def code_lines(text: str) -> int:
    """The number of lines with code."""
    docstrings = {
        line
        for node in ast.walk(ast.parse(text))
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node) is not None
        for line in range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1)
    }
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return len(
        {
            n
            for token in tokens
            if token.type not in LAYOUT
            for n in range(token.start[0], token.end[0] + 1)
        }
        - docstrings
    )


def count(package: Path) -> tuple[Counter[str], Counter[str]]:
    """Files and lines of code of the folders in `package`; what lies in none is counted as `.`."""
    files, lines = Counter[str](), Counter[str]()
    for path in package.rglob("*.py"):
        folder, *below = path.relative_to(package).parts
        name = folder if below else "."
        files[name] += 1
        lines[name] += code_lines(path.read_text(encoding="utf-8"))
    return files, lines


def main(package: Path) -> str:
    """The table: engine first, each folder with its files and lines, and both sums."""
    files, lines = count(package)
    rows = []
    for title, names in (("engine", set(lines) & ENGINE), ("the rest", set(lines) - ENGINE)):
        rows += [f"{name:14s} {files[name]:5d} {lines[name]:7d}" for name in sorted(names)]
        rows.append(
            f"{title:14s} {sum(files[n] for n in names):5d} {sum(lines[n] for n in names):7d}\n"
        )
    return "\n".join([*rows, f"{'all':14s} {files.total():5d} {lines.total():7d}"])


if __name__ == "__main__":
    print(main(Path(sys.argv[1]) if sys.argv[1:] else PACKAGE))
