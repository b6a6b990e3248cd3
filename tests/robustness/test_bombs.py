"""Inputs that claim or unfold to more than they are: refused from their size, before anything is
expanded or allocated.

All go through one child process that has imported what reads them; of each it tells how it ended,
the calls of functions it took, and the most memory that the process had held by then.
"""

from __future__ import annotations

import base64
import io
import json
import subprocess
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

from fmbs_skfem.core.storage import container
from fmbs_skfem.reduction import files

from .inputs import BEAM, MESHES, SHELL, STRIP, changed, lines, msh

CALLS = 200_000  #: of a refusal, of Python and from it; a right scene takes 72 000, refusals 50 to 85 000, every value unfolded one
MEMORY = 100.0  #: beyond what the process has held to read a right scene, about 220 MB with all libraries [MB]
WHOLE = 200.0  #: of a whole `fmbs check` that refuses [MB]

CHILD = """
import json, sys, warnings
from pathlib import Path
from fmbs_skfem import scenes
from fmbs_skfem.core.errors import FmbsError
from fmbs_skfem.reduction import files
from fmbs_skfem.scenes import build

readers = {".yaml": lambda path: build.system(scenes.read(path)), ".h5": files.read}
warnings.simplefilter("ignore")

def peak():
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))

def count(frame, event, argument):
    global calls
    calls += event in ("call", "c_call")

for name in ("first", *sys.argv[1:]):
    path, code, message = Path(name), 0, ""
    if name == "first":
        path = Path("right.yaml")
    calls = 0
    sys.setprofile(count)
    try:
        readers[path.suffix](path)
    except FmbsError as error:
        code, message = error.exit_code, str(error)
    finally:
        sys.setprofile(None)
    print(json.dumps([name, code, message[:2000], calls, peak()]))
"""

#: calls a command from a small process, since the size of the caller counts as that of the called
MEASURED = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[1:]).returncode
print(code, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""

LAUGHS = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 40)
)
POWERS = "a0: 1 m, " + ", ".join(f"a{i}: a{i - 1} * a{i - 1}" for i in range(1, 40))


def history(text: str) -> str:
    return changed(BEAM, 'history: "1"', f'history: "{text}"')


def number(text: str) -> str:
    return changed(BEAM, "1 GPa", text)


SCENES = {
    "aliases": (BEAM + LAUGHS, "at most 100000 values"),
    "aliases that nest": (
        "a0: &a0 [x]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 80)) + BEAM,
        "64 nested levels",
    ),
    "brackets": ("[" * 1_000_000, "lines of at most 100000 characters"),
    "fewer brackets": ("[" * 90_000, "64 nested levels"),
    "braces": ("{a: " * 20_000, "64 nested levels"),
    "dashes": ("- " * 40_000, "64 nested levels"),
    "levels": ("\n".join(" " * i + "a:" for i in range(1000)), "64 nested levels"),
    "large file": ("#" * (2 * 2**20 + 1), "a file of at most 2 MB"),
    "long line": ("name: " + "x" * 2**20, "lines of at most 100000 characters, got 1048582"),
    "digits": (number("9" * 1_000_000), "lines of at most 100000 characters"),
    "fewer digits": (number("9" * 5000), "a finite number, got inf"),
    "tower": (history("9**9**9**9"), "finite numbers"),
    "tower of a quantity": (number("9**9**9**9**9"), "math range error"),
    "long expression": (history("1+" * 500_000 + "1"), "lines of at most 100000 characters"),
    "shorter expression": (history("1+" * 1_001), "at most 2000 characters, got 2002"),
    "long quantity": (number("1+" * 500_000 + "1"), "lines of at most 100000 characters"),
    "parentheses": (history("(" * 900 + "t" + ")" * 900), "nested at most 64 deep"),
    "signs": (history("-" * 1900 + "t"), "nested at most 64 deep"),
    "powers": (history("t" + "**t" * 600), "nested at most 64 deep"),
    "powers of a unit": (
        changed(BEAM, "load: 0.5 N", f"{POWERS}, load: 0.5 N"),
        "a quantity whose unit has small powers",
    ),
    "steps": (
        changed(BEAM, "duration: 10 ms, step: 1 ms", "duration: 1e9, step: 1e-9"),
        "at most 10000000 steps",
    ),
    "more steps": (
        changed(BEAM, "duration: 10 ms, step: 1 ms", "duration: 1e300, step: 1e-300"),
        "at most 10000000 steps",
    ),
    "spans": (
        changed(BEAM, "step: 1 ms", "step: 1 ms, every: [{every: 1e-300}]"),
        "at most 10000000 states",
    ),
    "modes": (
        changed(
            BEAM,
            "{type: dynamic, duration: 10 ms, step: 1 ms}",
            f"{{type: modes, count: {10**18}}}",
        ),
        "1e+06",
    ),
    "refinement": (changed(BEAM, "line: beam", f"refine: {10**9}"), "a number <= 1000"),
}


def sealed(content: bytes) -> bytes:
    """A reduced model's file around an HDF5 file, with a header that fits."""
    return container.header(content, files.KIND) + content


def claimed(**options: object) -> bytes:
    """An HDF5 file whose one array claims 16 GB."""
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        file["tree"] = np.frombuffer(
            b'{"system": {"array": 0, "order": "C"}, "notes": {"dict": []}}', dtype=np.uint8
        )
        file.create_group("arrays").create_dataset("0", shape=(2 * 10**9,), dtype="f8", **options)
    return stream.getvalue()


def packed() -> str:
    """A `.vtu` with an array of a few kB that unpacks to 128 MB."""
    small = zlib.compress(bytes(2**27), 9)
    text = "".join(
        base64.b64encode(part).decode()
        for part in (np.array([1, 2**27, 2**27, len(small)], np.uint32).tobytes(), small)
    )
    array = f'<DataArray type="Int8" Name="x" format="binary">{text}</DataArray>'
    return changed((MESHES / "beam_100.vtu").read_text(), "</PointData>", array + "</PointData>")


def meshes() -> Iterator[tuple[str, str | bytes | Callable[[], str], str]]:
    text = msh([(0, 0), (1, 0)], lines((1, 2)))
    binary, vtu = (MESHES / "beam_5.msh").read_bytes(), (MESHES / "beam_100.vtu").read_text()
    yield "nodes.msh", changed(text, "$Nodes\n2", "$Nodes\n2000000000"), "at most 1000000 nodes"
    yield (
        "cells.msh",
        changed(text, "$Elements\n1", "$Elements\n2000000000"),
        "at most 1000000 cells",
    )
    yield "binary.msh", binary.replace(b"$Nodes\n6", b"$Nodes\n2000000000"), "at most 1000000 nodes"
    yield "fewer.msh", binary.replace(b"$Nodes\n6", b"$Nodes\n1000"), "no more than fit into its"
    yield (
        "points.vtu",
        changed(vtu, 'NumberOfPoints="101"', 'NumberOfPoints="2000000000"'),
        "at most 1000000",
    )
    yield "unpacks.vtu", packed, "above 67108864"
    laughs = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 30))
    yield (
        "entities.vtu",
        f'<!DOCTYPE x [<!ENTITY a0 "x">{laughs}]>' + vtu.replace("<Piece", "&a29;<Piece"),
        "entity declaration",
    )


def nurbs() -> Iterator[tuple[str, str, str]]:
    yield "brackets.json", "[" * 1_000_000, "JSON"
    yield (
        "digits.json",
        json.dumps(STRIP).replace("0.5", "9" * 1_000_000, 1),
        "a finite number, got inf",
    )
    yield "spaces.json", " " * (64 * 2**20 + 1), "at most 67108864 bytes"


pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")


@pytest.fixture(scope="module")
def bombs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[int, str, int, float]]:
    """Name of every bomb -> exit code, message, calls and growth of the process [MB]."""
    folder = tmp_path_factory.mktemp("bombs")
    (folder / "beam_5.msh").write_bytes((MESHES / "beam_5.msh").read_bytes())
    (folder / "right.yaml").write_text(BEAM)
    for name, (text, _) in SCENES.items():
        (folder / f"{name}.yaml").write_text(text)
    for name, content, _ in meshes():
        made = content() if callable(content) else content
        (folder / name).write_bytes(made if isinstance(made, bytes) else made.encode())
        (folder / f"{name}.yaml").write_text(changed(BEAM, "beam_5.msh", name))
    for name, text, _ in nurbs():
        (folder / name).write_text(text)
        (folder / f"{name}.yaml").write_text(changed(SHELL, "roof.json", name))
    (folder / "cells.yaml").write_text(
        changed(SHELL, "roof.json", f"strip.json\n    cells: {10**6}")
    )
    (folder / "strip.json").write_text(json.dumps(STRIP))
    (folder / "model.h5").write_bytes(sealed(claimed(chunks=(1024,))))
    (folder / "zipped.h5").write_bytes(sealed(claimed(chunks=(10**6,), compression="gzip")))
    names = [
        *sorted(path.name for path in folder.glob("*.yaml") if path.name != "right.yaml"),
        "model.h5",
        "zipped.h5",
    ]
    done = subprocess.run(
        [sys.executable, "-c", CHILD, *names],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=900,
    )
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert rows[0][:2] == ["first", 0]
    return {
        name: (code, message, calls, memory - rows[0][4])
        for name, code, message, calls, memory in rows[1:]
    }


EXPECTED = (
    {f"{name}.yaml": message for name, (_, message) in SCENES.items()}
    | {f"{name}.yaml": message for name, _, message in meshes()}
    | {f"{name}.yaml": message for name, _, message in nurbs()}
    | {"cells.yaml": "at most 1000000"}
)
MODELS = ("model.h5", "zipped.h5")


#: texts as large as they may be, which cost most to read: every value an object of its own, and
#: four bytes for every character
COSTLY = {
    "values": "x:\n" + f"  - {'a' * 15}\n" * 99_000,
    "characters": f"# {'x' * 90_000}\n" * 23 + "# \U0001f600\n",
    "lines": "\n" * (2 * 2**20 - 1),
}


@pytest.mark.parametrize("name", COSTLY)
def test_the_whole_command_stays_small(name: str, tmp_path: Path) -> None:
    """The most that `fmbs check` holds, with the interpreter and all libraries."""
    path = tmp_path / "scene.yaml"
    path.write_text(COSTLY[name], encoding="utf-8")
    command = [
        sys.executable,
        "-c",
        MEASURED,
        str(Path(sys.executable).parent / "fmbs"),
        "check",
        str(path),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    code, most = map(int, done.stdout.split())
    assert code == 3, done.stderr
    assert most / 1024 < WHOLE


@pytest.mark.parametrize("name", [*EXPECTED, *MODELS])
def test_refused_by_its_size(name: str, bombs: dict[str, tuple[int, str, int, float]]) -> None:
    code, message, calls, memory = bombs[name]
    assert code == (8 if name in MODELS else 3), message
    assert EXPECTED.get(name, "of 16000000000 bytes of float64, of which 0 are stored") in message
    assert calls < CALLS
    assert memory < MEMORY
