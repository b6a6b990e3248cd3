"""The command as a whole: help without heavy imports, usage errors, errors and notices of every
kind.
"""

import errno
import inspect
import re
import subprocess
import sys
from pathlib import Path
from typing import Unpack

import click
import pytest
from click.testing import CliRunner

from fmbs_skfem import studies
from fmbs_skfem.cli import common, screen
from fmbs_skfem.cli.main import COMMANDS, GROUPS, main
from fmbs_skfem.core.errors import (
    CorruptFile,
    FmbsError,
    InputError,
    MissingFeature,
    Reason,
    SolverError,
)
from fmbs_skfem.core.notices import notify
from fmbs_skfem.studies import ReportTable, Result
from fmbs_skfem.studies import job as jobs
from fmbs_skfem.studies.options import OutputOptions

from .. import pages
from .calls import EXAMPLES, ROOT, fmbs
from .test_train import kept

SWING = """\
schema: 1
name: swing
dimension: 2
parameters: {g: 9.81 m/s^2}
bodies:
  upper: &arm
    type: cable
    mesh: beam_10.msh
    line: beam
    cells: 12
    section: {shape: circular, diameter: 10 mm}
    material: {young_modulus: 0.1 GPa, density: 1800 kg/m^3}
  lower: {<<: *arm, origin: [1, 0]}
joints:
  hinge: {type: pin, at: upper.left, to: ground}
  elbow: {type: pin, at: upper.right, to: lower.left}
loads:
  weight: {type: gravity, acceleration: [0, -g]}
analysis: {type: dynamic, duration: 0.8 s, step: 1 ms}
outputs:
  tip: {type: position, at: lower.right}
  hinge: {type: reaction, joint: hinge}
  held: {type: position, at: upper.left}
  turn: {type: angle, at: {body: upper, s: 0.5}}
reduction: {snapshots: 4 ms, tolerance: 1e-11, hyper_reduction: {tolerance: 1e-3, sample: points}}
"""

HEAVY = (
    "importlib.abc",
    "numba",
    "pyvista",
    "vtkmodules",
    "matplotlib",
    "scipy",
    "numpy",
    "sklearn",
    "distributed",
    "rich",
)


def test_help_imports_nothing_heavy() -> None:
    """One command after the other in one process, which has nothing heavy behind the last."""
    calls = [["--help"], ["--version"], *([name, "--help"] for name in COMMANDS)]
    code = (
        "import sys\nbefore = set(sys.modules)\nfrom fmbs_skfem.cli.main import main\n"
        f"for arguments in {calls!r}:\n    main(arguments, standalone_mode=False)\n"
        f"    print(arguments, sorted(set({HEAVY!r}) & set(sys.modules) - before))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = done.stdout.splitlines()
    assert [line for line in said if line.startswith("[")] == [
        f"{arguments} []" for arguments in calls
    ]


def test_a_check_of_a_scene_imports_only_what_it_uses() -> None:
    """The parts of scipy that are slow to import, and what compiles, reads other mesh formats or
    draws.
    """
    scipy = ("scipy.optimize", "scipy.interpolate", "scipy.spatial", "scipy.special")
    own = (
        "results",
        "families",
        "verification",
        "dynamics.many",
        "dynamics.equilibria.arclength",
        "dynamics.near_state.buckling",
    )
    own += ("dynamics.diagnoses.diagnosis", "reduction.files", "reduction.spaces.ffrf")
    numpy = ("numpy.f2py", "numpy.testing")
    unused = (
        *scipy,
        *(f"fmbs_skfem.{name}" for name in own),
        *numpy,
        "rich",
        "matplotlib",
        "meshio",
        "skfem",
        "sympy",
        "numba",
    )
    code = (
        "import sys\nfrom fmbs_skfem.cli.main import main\n"
        f"main(['check', {str(EXAMPLES / 'double_pendulum.yaml')!r}], standalone_mode=False)\n"
        f"print(sorted(set({unused!r}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "[]"


def without_numba(folder: Path, *call: str) -> None:
    """By a process that may compile, as this one may have what no folder keeps, and by another,
    which has it all.
    """
    for name in ("first", "second"):
        given = [*call, "--out", str(folder / name)]
        code = (
            "import sys\nfrom fmbs_skfem.cli.main import main\n"
            f"assert not main({given!r}, standalone_mode=False)\nprint('numba' in sys.modules)"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "False"


def test_what_is_compiled_runs_without_numba(tmp_path: Path) -> None:
    without_numba(tmp_path, "run", str(EXAMPLES / "hanging_mass.yaml"), "--duration", "0.01")
    first, second = ((tmp_path / name / "outputs.csv").read_bytes() for name in ("first", "second"))
    assert first == second


def test_reductions_do_without_numba(tmp_path: Path) -> None:
    """Hyper-reductions and laws as well."""
    scene = kept(tmp_path / "swing.yaml", SWING)
    without_numba(tmp_path, "reduce", str(scene), "--force")


def test_the_module_is_the_command() -> None:
    for module in ("fmbs_skfem", "fmbs_skfem.cli.main"):
        call = [sys.executable, "-m", module]
        assert subprocess.run(
            [*call, "--version"], capture_output=True, text=True
        ).stdout.startswith("fmbs, version")
        assert (
            subprocess.run(
                [*call, "check", "nowhere.yaml"], capture_output=True, text=True
            ).returncode
            == 3
        )


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself_and_takes_json_and_out(name: str) -> None:
    done = fmbs(name, "--help")
    assert done.code == 0
    assert {"--json", "--out"} <= set(done.out.split())
    assert name in fmbs("--help").out
    assert not re.search(r"In\s+Python|\braised?\b|\braises\b|concurrent\.futures", done.out)


def test_an_unknown_command_is_a_usage_error_with_a_hint() -> None:
    done = fmbs("rum")
    assert done.code == 2
    assert "did you mean 'run'?" in done.err
    assert done.out == ""


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (
            ("rom", "model.h5"),
            "expected one of the commands export, info, run before the file, such as 'fmbs rom run model.h5', got 'model.h5'",
        ),
        (("part", "arm.h5"), "before the file, such as 'fmbs part info arm.h5', got 'arm.h5'"),
        (
            ("rom", "rum"),
            "expected one of the commands export, info, run, got 'rum'; did you mean 'run'?",
        ),
        (("four_bar.yaml",), "before the file, such as 'fmbs run four_bar.yaml', got"),
    ],
)
def test_a_file_in_place_of_a_command_shows_the_call_that_was_meant(
    call: tuple[str, ...], told: str
) -> None:
    done = fmbs(*call)
    assert done.code == 2
    assert told in done.err.replace("'main ", "'fmbs ")


def test_an_argument_too_many_shows_the_options_that_take_values() -> None:
    done = fmbs("verify", "pendulum")
    assert done.code == 2
    assert (
        "expected values behind their options (--case NAME, --group GROUP, --out DIR), got 'pendulum'"
        in done.err
    )


def test_a_missing_argument_and_a_wrong_set_are_usage_errors() -> None:
    assert fmbs("run").code == 2
    done = fmbs("check", "scene.yaml", "--set", "load")
    assert done.code == 2
    assert "expected NAME=VALUE, got 'load'" in done.err


def test_a_missing_scene_is_bad_input() -> None:
    done = fmbs("check", "no-such-scene.yaml", "--json")
    assert done.code == 3
    assert done.json["status"] == "error"
    assert done.json["reason"] == "bad input"
    assert "no-such-scene.yaml" in done.json["message"]
    assert "Traceback" not in done.err


ERRORS = [
    (InputError("a: expected b"), 3, "bad input"),
    (SolverError("no way", Reason.DIVERGED, 0.5, (("beam", 2.0),)), 4, "Newton iteration diverged"),
    (MissingFeature("no OpenGL"), 7, "missing feature"),
    (CorruptFile("damaged"), 8, "corrupt file"),
    (KeyboardInterrupt(), 130, "interrupted"),
    (PermissionError("not yours"), 3, "file"),
    (OSError(errno.ENOSPC, "No space left on device"), 6, "limit reached"),
    (MemoryError("Unable to allocate 745. GiB"), 6, "limit reached"),
    (ZeroDivisionError("oh"), 1, "internal error"),
]


@pytest.mark.parametrize(
    ("error", "code", "reason"), ERRORS, ids=[type(error).__name__ for error, _, _ in ERRORS]
)
def test_errors_have_their_exit_code_and_no_traceback(
    error: BaseException, code: int, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    def fails(**options: Unpack[OutputOptions]) -> Result:
        raise error

    command = common.command("fails", fails)
    done = CliRunner().invoke(command, ["--json"])
    assert done.exit_code == code
    assert f'"reason": "{reason}"' in done.stdout
    assert "Traceback" not in done.stderr
    if isinstance(error, SolverError):
        assert '"time": 0.5' in done.stdout
        assert '"name": "beam"' in done.stdout
    if isinstance(error, ZeroDivisionError):
        assert "please report it" in done.stderr
        assert "Traceback" in CliRunner().invoke(command, ["--debug"]).stderr


def test_notices_go_to_stderr_and_json_once_and_stop_a_strict_call() -> None:
    def study(**options: Unpack[OutputOptions]) -> Result:
        with jobs.begin(**options) as job:
            for _ in range(3):
                notify("mind the gap")
            return Result(
                about="",
                report={"status": "ok", "ratio": float("nan"), "notices": job.notices},
                lines=["done"],
            )

    notes = common.command("notes", study)
    done = CliRunner().invoke(notes, ["--json"])
    assert done.stderr == "warning: mind the gap\n"
    assert done.stdout.count("mind the gap") == 1
    assert '"ratio": null' in done.stdout
    assert CliRunner().invoke(notes, []).stdout == "done\n"
    strict = CliRunner().invoke(notes, ["--strict"])
    assert strict.exit_code == 3
    assert "an error by --strict" in strict.stderr


def test_tables_show_brackets_and_numbers_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "out.txt"
    with path.open("w") as file:
        ReportTable("Mass [kg]", ("body [-]", "mass [kg]"), [("a[b]", 1 / 3)]).print(file)
    text = path.read_text()
    assert all(part in text for part in ("Mass [kg]", "body [-]", "mass [kg]", "a[b]", "0.333333"))


def test_tables_take_the_letters_of_their_file(tmp_path: Path) -> None:
    path = tmp_path / "out.txt"
    with path.open("w", encoding="ascii") as file:
        ReportTable("Mass", ("body", "mass [kg]"), [("é", 1 / 3)]).print(file)
    assert path.read_text().splitlines() == [
        "Mass",
        "",
        "  body   mass [kg]",
        " ------------------",
        "  \\xe9    0.333333",
        "",
    ]


@pytest.mark.parametrize("width", [132, 80, 60, 40, 20])
def test_no_word_or_number_of_a_table_is_cut(width: int) -> None:
    """Every word is there once for every block, in the order of its cell, and no line is longer
    than the terminal.
    """
    columns = ("model", "CPU [s]", *(f"error of output {k}" for k in range(9)), "what that does")
    rows = [(f"model-{row}", 0.1234 + row, *(1.0 / (3 + row + k) for k in range(9)), "a sentence that is long enough to be broken")
            for row in range(3)]  # fmt: skip
    text = ReportTable("A table of many columns", columns, rows, names=True).text(width)
    assert max(map(len, text.splitlines())) <= width
    found = text.split()
    for cell in [*columns, *(cell for row in rows for cell in row)]:
        words = f"{cell:.6g}".split() if isinstance(cell, float) else cell.split()
        assert all(word in found for word in words), cell


def test_tables_that_fit_are_in_one_piece_and_letters_of_two_places_count_twice() -> None:
    table = ReportTable("Mass", ("body", "mass [kg]"), [("質量", 1 / 3), ("arm", -0.0)])
    assert table.text(80).splitlines() == [
        "Mass",
        "",
        "  body   mass [kg]",
        " ──────────────────",
        "  質量    0.333333",
        "  arm            0",
        "",
    ]
    assert "─" not in ReportTable("", ("", ""), [("dofs", 12), ("mass", 0.5)]).text(80)


def test_every_command_is_a_click_command_of_its_name() -> None:
    assert isinstance(main, click.Group)
    for name in COMMANDS:
        found = main.get_command(click.Context(main), name)
        assert isinstance(found, click.Command)
        assert found.name == name


@pytest.mark.parametrize(
    "name", ["check", "run", "sweep", "reduce", "train", "render", "compare", "verify"]
)
def test_every_keyword_of_a_study_is_an_option_that_says_what_it_is(name: str) -> None:
    found = main.get_command(click.Context(main), name)
    assert found is not None
    options = {one.name: one for one in found.params}
    keywords = set(inspect.signature(getattr(studies, name)).parameters) - {"shared"}
    assert keywords <= options.keys()
    assert all(one.help for one in options.values() if isinstance(one, click.Option))


def test_long_work_tells_a_log_how_far_it_is(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter([0.0, 0.0, 10.0, 40.0, 50.0, 75.0])
    monkeypatch.setattr(screen.time, "perf_counter", lambda: next(clock))
    bar = screen.Bar()
    for part in (0.0, 0.1, 0.4, 0.5, 0.75):
        bar.progress("1000 samples", part)
    assert capsys.readouterr().err == "1000 samples: 40% after 40 s\n1000 samples: 75% after 75 s\n"


def test_pages_name_every_command_with_options_that_it_has() -> None:
    """Lines of the shell in the README and in docs/commands.md; their examples are there."""
    text = "\n".join(
        block for page in ("README.md", "docs/commands.md") for block in pages.blocks(page, "sh")
    )
    calls = [
        re.split(r"\s#|&&", rest)[0].split()
        for rest in re.findall(r"(?:^|/| )fmbs (\w.*)$", text, re.MULTILINE)
    ]
    assert {call[0] for call in calls} == set(COMMANDS)
    context = click.Context(main)
    for call in calls:
        command = main.get_command(context, call[0])
        if call[0] in GROUPS:
            group = GROUPS[call[0]]()
            command = group.get_command(context, call[1])
        assert command is not None, call
        known = {name for parameter in command.params for name in parameter.opts}
        assert {word for word in call if word.startswith("--")} <= known, call
        assert all((ROOT / word).is_file() for word in call if word.startswith("examples/")), call


def test_the_page_of_commands_has_all_exit_codes() -> None:
    """Those of the help, and of every class of errors."""
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    listed = {int(code) for code in re.findall(r"^\| (\d+) \|", page, re.MULTILINE)}
    helped = (main.help or "").partition("Exit codes:")[2]
    assert listed == set(map(int, re.findall(r"\d+", helped)))
    assert {error.exit_code for error in FmbsError.__subclasses__()} <= listed
