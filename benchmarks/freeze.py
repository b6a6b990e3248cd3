"""What users get: answers, exit codes, messages and files of every command, kept to be compared
after a change.

    python benchmarks/freeze.py FOLDER [NAME ...]       write FOLDER/NAME.json for every call below, or for those named
    python benchmarks/freeze.py --compare BEFORE AFTER  list what differs, exit code 1 if anything does

Motions of scenes take STEPS steps. Numbers differ where |a - b| > RELATIVE max(|a|, |b|) + FLOOR.
Times, versions, the machine and places of files are not compared.
"""

from __future__ import annotations

import csv
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
from fmbs_skfem.scenes.dynamic import Dynamic

from fmbs_skfem import scenes

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
#: below FLOOR numbers are round-off of coordinates of size 1
STEPS, RELATIVE, FLOOR = (
    40,
    1e-9,
    1e-16,
)
#: keys of times, of what follows from them, of the machine, and of hashes of files in which times
#: stand
PASSING = re.compile(
    r"(?!.*per_s$).*_u?s|(cpu_s|pays|OUT).*|choice|front|overhead|speedup|versions|machine|threads|sha256"
)
TIMES = re.compile(r"[-+.e\d]+ +(?=(ms|s|min|h)\b)|^[\da-f]{64} ")  #: the same in words
NUMBER = re.compile(r"[-+]?(\d+\.?\d*(e[-+]?\d+)?|inf|nan)")
PROGRESS = re.compile(r"^(first run: compiling|.*\d+% after ).*\n?", re.MULTILINE)
#: those whose coarse variant is run
SLOW = {
    "crank_slider",
    "crank_slider_young",
    "crank_slider_torque",
}
CALLS = """\
run.words run MOTION:double_pendulum --units --out OUT/run.words
check.words check EXAMPLES/double_pendulum.yaml
export export MOTION:double_pendulum --frames 3 --json --out OUT/export
reduce reduce MOTION:pendulum_family --json --out OUT/reduce/m.h5
rom.info rom info OUT/reduce/m.h5 --json
train train MOTION:pendulum_family --tolerance 0.05 --iterations 2 --holdout 1 --no-plots --json --out OUT/train
rom.run rom run OUT/train/model.h5 --set "E=1.1 GPa" --no-plots --json --out OUT/rom.run
rom.outside rom run OUT/train/model.h5 --set "E=9 GPa" --no-plots --json --strict --out OUT/rom.outside
sweep sweep MOTION:pendulum_family --samples 4 --workers 1 --no-plots --json --out OUT/sweep
refused.train train MOTION:pendulum_family --no-plots --json --out OUT/refused.train
compare compare EXAMPLES/spin_up.yaml --duration 0.05 --quick --no-picture --json --out OUT/compare
part.train part train EXAMPLES/four_bar.yaml --body coupler --alone --runs 1 --duration 0.2 --samples 20 --json --out OUT/part.train
part.info part info OUT/part.train/coupler.part.h5 --json
new new mine --json --out OUT/new
schema schema --json
schema.page schema --page
verify verify --json --out OUT/verify
refused.key run EXAMPLES/beck_column.yaml --set Q=1 --json
refused.unit run EXAMPLES/beck_column.yaml --set "P=1 kg" --json
refused.value run EXAMPLES/beck_column.yaml --set "P=two N"
refused.file check EXAMPLES/roof.json --json
refused.command chekc
refused.model rom info EXAMPLES/beck_column.yaml
"""
HELP = "check, run, resume, reduce, train, rom, part, compare, sweep, render, export, verify, schema, new, demo, warm"


def calls(out: Path) -> dict[str, list[str]]:
    """Arguments of `fmbs` by the name under which the answer is kept; later ones use the files of
    earlier ones.
    """
    paths = sorted([*EXAMPLES.glob("*.yaml"), *EXAMPLES.glob("parts/*.yaml")])
    names, examples = (
        [path.relative_to(EXAMPLES).with_suffix("").as_posix() for path in paths],
        str(EXAMPLES),
    )
    lines = [f"check.{name} check EXAMPLES/{name}.yaml --json" for name in names]
    lines += [
        f"run.{name} run MOTION:{name} --no-plots --json --out OUT/run.{name}"
        for name in names
        if name not in SLOW
    ]
    lines += [f"help.{command} {command} --help" for command in HELP.split(", ")]
    found = {}
    for line in [*lines, *CALLS.splitlines()]:
        name, *words = shlex.split(line)
        parts = (motion(word[7:]) if word.startswith("MOTION:") else [word] for word in words)
        found[name.replace("/", ".")] = [
            p.replace("EXAMPLES", examples).replace("OUT", str(out)) for part in parts for p in part
        ]
    return found


def motion(name: str) -> list[str]:
    """An example with the option that shortens its motion to STEPS steps."""
    path = EXAMPLES / f"{name}.yaml"
    analysis = scenes.read(path).analysis
    return (
        [str(path), "--duration", repr(STEPS * analysis.step)]
        if isinstance(analysis, Dynamic)
        else [str(path)]
    )


def freeze(out: Path, names: list[str]) -> None:
    """Make the calls and write what they gave."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "COLUMNS": "100", "NO_COLOR": "1"}
    out.mkdir(parents=True, exist_ok=True)
    for name, arguments in calls(out / "files").items():
        if names and name not in names:
            continue
        command = [
            sys.executable,
            "-m",
            "fmbs_skfem",
            *arguments,
            *(["--force"] if "--out" in arguments else []),
        ]
        done = subprocess.run(
            command, capture_output=True, text=True, env=environment, cwd=ROOT, check=False
        )
        folder = out / "files" / name
        kept = {
            file.relative_to(folder).as_posix(): content(file)
            for file in sorted(folder.rglob("*"))
            if file.is_file()
        }
        said = (
            json.loads(done.stdout)
            if "--json" in arguments and done.stdout.startswith("{")
            else done.stdout.splitlines()
        )
        answer = {
            "exit": done.returncode,
            "out": said,
            "err": PROGRESS.sub("", done.stderr).splitlines(),
            "files": kept,
        }
        text = json.dumps(answer, indent=1).replace(str(out), "OUT").replace(str(ROOT), "ROOT")
        (out / f"{name}.json").write_text(text, encoding="utf-8")
        print(f"{name}: exit code {done.returncode}", flush=True)


def content(path: Path) -> Any:
    """What can be compared of a file: keys and shapes of a container; of a table its head and last
    line; numbers of JSON.
    """
    if path.suffix == ".h5":
        with h5py.File(path, "r") as file:
            found: dict[str, Any] = {}
            file.visititems(
                lambda key, item: found.__setitem__(
                    key, f"{getattr(item, 'dtype', '')} {getattr(item, 'shape', '')}"
                )
            )
            return found | (
                {"tree": json.loads(file["tree"][()].tobytes(), parse_float=lambda _: "float")}
                if "tree" in file
                else {}
            )
    if path.suffix == ".csv":
        head, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
        last = (float(word) if NUMBER.fullmatch(word) else word for word in rows[-1])
        return dict(zip(["lines", *head], [len(rows), *last], strict=True))
    return json.loads(path.read_text(encoding="utf-8")) if path.suffix == ".json" else ""


def differences(a: Any, b: Any, place: str) -> Iterator[str]:
    """What differs between two answers, with its place."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in [*a, *(key for key in b if key not in a)]:
            if not PASSING.fullmatch(key):
                yield from differences(
                    a.get(key, "(absent)"), b.get(key, "(absent)"), f"{place}.{key}"
                )
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        for index, pair in enumerate(zip(a, b, strict=True)):
            yield from differences(*pair, f"{place}[{index}]")
    elif isinstance(a, float | int) and isinstance(b, float | int):
        if repr(a) != repr(b) and not abs(a - b) <= RELATIVE * max(abs(a), abs(b)) + FLOOR:
            yield f"{place}: {a!r} -> {b!r}"
    elif TIMES.sub("", str(a)) != TIMES.sub("", str(b)):
        yield f"{place}: {a!r:.300} -> {b!r:.300}"


def compare(before: Path, after: Path) -> bool:
    """Print what differs between two folders; whether anything does."""
    kept = [
        {
            path.stem: json.loads(path.read_text(encoding="utf-8"))
            for path in sorted(d.glob("*.json"))
        }
        for d in (before, after)
    ]
    listed = "\n".join(differences(*kept, ""))
    print(listed or "no differences")
    return bool(listed)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--compare"]:
        sys.exit(compare(*map(Path, sys.argv[2:])))
    freeze(Path(sys.argv[1]).absolute(), sys.argv[2:])
