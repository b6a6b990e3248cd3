"""Libraries of an FMU: its sources compiled for this machine, or with zig, a C compiler of the
extra `fmu`, for all machines.
"""

from __future__ import annotations

import platform
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from ..core import extras
from .text import template

ZIG = sys.executable, "-m", "ziglang", "cc"  #: of the extra `fmu`
#: the same round-off everywhere: no products are fused with sums
FLAGS = (
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fvisibility=hidden",
    "-shared",
    "-s",
)


class Machine(NamedTuple):
    """A system with its processor."""

    folder: str  #: in an FMU of FMI 3
    old_folder: str  #: in an FMU of FMI 2
    ending: str  #: of a library
    target: str  #: of zig
    flags: tuple[str, ...] = ()


# For Windows zig takes a second without the library of C, and minutes with it; on Linux the program
# that loads a library has it.
BARE = ("-nostdlib", "-fno-builtin", "-lkernel32")
MACHINES = (
    Machine("x86_64-windows", "win64", "dll", "x86_64-windows-gnu", BARE),
    Machine("x86_64-linux", "linux64", "so", "x86_64-linux-gnu", ("-fPIC", "-nostdlib")),
    Machine("aarch64-linux", "aarch64-linux", "so", "aarch64-linux-gnu", ("-fPIC", "-nostdlib")),
    Machine("x86_64-darwin", "darwin64", "dylib", "x86_64-macos"),
    Machine("aarch64-darwin", "darwin64", "dylib", "aarch64-macos"),
)


class Binary(NamedTuple):
    """A library, and the folder in which an FMU has it."""

    folder: str
    ending: str
    content: bytes


class Built(NamedTuple):
    """Libraries, the compiler that made them, and what it could not make."""

    compiler: str  #: empty where there is none
    binaries: tuple[Binary, ...]
    failed: Mapping[str, str]  #: what the compiler said, by machine


def find_compiler() -> tuple[str, list[str]]:
    """zig where it is installed, else the machine's own C compiler; its name and its command, both
    empty where there is none.
    """
    if extras.there("fmu"):
        return "zig", [*ZIG, "-fno-sanitize=all"]
    own = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
    return (Path(own).stem, [own]) if own else ("", [])


def this_machine() -> Machine | None:
    """That of the running program."""
    name = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    here = f"{name}-{ {'win32': 'windows', 'darwin': 'darwin'}.get(sys.platform, 'linux') }"
    return next((one for one in MACHINES if one.folder == here), None)


def build(files: Mapping[str, str], version: int) -> Built:
    """Libraries of the sources among the files of an FMU, for FMI 2 or 3."""
    name, command = find_compiler()
    own = this_machine()
    machines = () if not name else MACHINES if name == "zig" else (() if own is None else (own,))
    with tempfile.TemporaryDirectory() as folder:
        sources = []
        for path, text in {**files, "windows.c": template("windows.c")}.items():
            if path.endswith((".c", ".h")):
                place = Path(folder) / Path(path).name
                place.write_text(text, encoding="utf-8")
                sources += [place] if path.endswith(".c") else []
        with ThreadPoolExecutor(2) as pool:
            made = list(
                pool.map(
                    lambda one: compile_for(one, name, command, sources, Path(folder)), machines
                )
            )
    good = {
        one: content
        for one, content in zip(machines, made, strict=True)
        if isinstance(content, bytes)
    }
    failed = {
        one.folder: text for one, text in zip(machines, made, strict=True) if isinstance(text, str)
    }
    return Built(name, tuple(placed(good, version)), failed)


def compile_for(
    machine: Machine, name: str, command: Sequence[str], sources: Sequence[Path], folder: Path
) -> bytes | str:
    """A library for a machine, or what the compiler said."""
    target = folder / f"{machine.folder}.{machine.ending}"
    bare = machine.flags is BARE
    chosen = [one.name for one in sources if bare or one.name != "windows.c"]
    own = ("-target", machine.target) if name == "zig" else ()
    line = [*command, *own, *FLAGS, "-o", target.name, *chosen, *machine.flags]
    done = subprocess.run(
        line, cwd=folder, capture_output=True, text=True, errors="replace", check=False
    )
    return (
        target.read_bytes()
        if done.returncode == 0 and target.exists()
        else (done.stderr or done.stdout)[-2000:]
    )


def placed(made: Mapping[Machine, bytes], version: int) -> list[Binary]:
    """Libraries in the folders of an FMU; of FMI 2 with one folder for both processors of macOS."""
    if version == 3:
        return [Binary(one.folder, one.ending, content) for one, content in made.items()]
    found: dict[str, list[tuple[Machine, bytes]]] = {}
    for one, content in made.items():
        found.setdefault(one.old_folder, []).append((one, content))
    return [
        Binary(
            folder,
            many[0][0].ending,
            many[0][1] if len(many) == 1 else universal([content for _, content in many]),
        )
        for folder, many in found.items()
    ]


def universal(parts: Sequence[bytes]) -> bytes:
    """One library of macOS for several processors: a table of what begins where (fat.h of Mach-O),
    and the libraries on pages.
    """
    page = 14  # 2^14 bytes, the largest page of both processors
    count = len(parts)
    size = 1 << page
    rows = []
    body = []
    at = size
    for part in parts:
        processor, kind = struct.unpack("<II", part[4:12])
        rows.append(struct.pack(">IIIII", processor, kind, at, len(part), page))
        body.append(part + bytes(-len(part) % size))
        at += len(body[-1])
    table = struct.pack(">II", 0xCAFEBABE, count) + b"".join(rows)
    return table + bytes(size - len(table)) + b"".join(body)
