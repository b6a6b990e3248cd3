"""Processes that run calls: what they answer, how they end, and what they have of this one."""

from __future__ import annotations

import os
import pkgutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from multiprocessing.context import SpawnProcess
from pathlib import Path

import pytest

from fmbs_skfem.core import consents, processes
from fmbs_skfem.core.processes import Processes

from ..cli.calls import scene
from ..hard_cases import alive

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and sockets of POSIX")
SOURCE = Path(__file__).parents[2] / "src"
START = f"import sys; sys.path.insert(0, {str(SOURCE)!r})\nfrom fmbs_skfem.core.processes import Processes\n"
CUT = """
import os, signal
from multiprocessing.connection import Connection
send = Connection._send
def cut(line, data):
    send(line, data[:5])
    os.kill(os.getpid(), signal.SIGKILL)
Connection._send = cut
"""
RAISE = """
from fmbs_skfem.core.errors import Reason, SolverError
raise SolverError("t = 0.5: no", Reason.DIVERGED, 0.5)
"""


@pytest.fixture
def worker() -> Iterator[Processes]:
    with Processes(1) as made:
        yield made


def only(worker: Processes) -> SpawnProcess:
    """The only process."""
    ((one, _),) = worker.running.values()
    return one


def pid(worker: Processes) -> int:
    """Of the only process, which is started where there is none."""
    found = worker.submit(os.getpid).result(timeout=60)
    assert only(worker).pid == found
    return int(found)


def test_calls_are_answered_in_their_order(worker: Processes) -> None:
    found = [worker.submit(pow, k, 2) for k in range(20)]
    assert [one.result(timeout=60) for one in found] == [k * k for k in range(20)]
    assert worker.submit(int, "ff", base=16).result(timeout=60) == 255
    assert pid(worker) == pid(worker)


def test_a_process_has_one_thread_and_nothing_of_the_current_folder(worker: Processes) -> None:
    before = dict(os.environ)
    for name in processes.ONE_THREAD:
        assert worker.submit(os.getenv, name).result(timeout=60) == "1"
    assert worker.submit(eval, "__import__('sys').flags.safe_path").result(timeout=60)
    assert dict(os.environ) == before
    if sys.platform == "linux":
        assert (
            worker.submit(eval, "int(open('/proc/self/oom_score_adj').read())").result(timeout=60)
            == processes.FIRST_TO_GO
        )


@pytest.mark.parametrize("word", consents.WORDS)
def test_a_process_has_the_consent_of_the_call(word: str) -> None:
    """As `--allow-extensions` gives it."""
    with consents.given(word):
        worker = Processes(1)
    assert worker.submit(os.getenv, consents.SWITCH).result(timeout=60) == word
    worker.shutdown()


def test_errors_come_back_with_the_traceback_of_the_process(worker: Processes) -> None:
    with pytest.raises(ZeroDivisionError) as caught:
        worker.submit(eval, "1 / 0").result(timeout=60)
    assert "in a worker process" in caught.value.__notes__[0]
    for text in (RAISE, "raise SystemExit(3)", "raise KeyboardInterrupt"):
        with pytest.raises(RuntimeError, match="in a worker process"):
            worker.submit(exec, text).result(timeout=60)
    assert worker.submit(pow, 3, 2).result(timeout=60) == 9


def test_functions_without_a_name_go_by_value(worker: Processes) -> None:
    """As those of notebooks."""
    factor = 3
    assert worker.submit(lambda value: factor * value, 4).result(timeout=60) == 12


@pytest.mark.parametrize(
    "text",
    ["import os, signal; os.kill(os.getpid(), signal.SIGKILL)", "import os; os._exit(1)", CUT],
)
def test_a_process_that_ends_loses_its_own_call_and_is_replaced(
    worker: Processes, text: str
) -> None:
    """Also one that ends while it sends, for which a ProcessPoolExecutor waits for ever."""
    before = pid(worker)
    lost, waiting = worker.submit(exec, text, {}), worker.submit(pow, 3, 2)
    with pytest.raises(BrokenExecutor):
        lost.result(timeout=60)
    assert waiting.result(timeout=60) == 9
    assert pid(worker) != before


def test_a_process_that_ends_while_nothing_is_asked_of_it_is_replaced(worker: Processes) -> None:
    os.kill(before := pid(worker), signal.SIGKILL)
    only(worker).join()
    assert worker.submit(pow, 3, 2).result(timeout=60) == 9
    assert pid(worker) != before


def test_others_go_on_where_a_process_ends() -> None:
    """Two calls that wait for each other, so that two processes have them; one ends, and two are
    there again.
    """
    with Processes(2) as workers:
        long, lost = workers.submit(time.sleep, 0.2), workers.submit(os._exit, 1)
        with pytest.raises(BrokenExecutor):
            lost.result(timeout=60)
        assert long.result(timeout=60) is None
        assert [workers.submit(pow, 3, 2).result(timeout=60) for _ in range(9)] == [9] * 9
        assert len(workers.running) <= 2


def test_a_process_sees_no_interrupts(worker: Processes) -> None:
    """Neither while it starts nor later: Ctrl-C goes to all processes of a terminal."""
    first = worker.submit(pow, 3, 2)
    while not worker.running:
        time.sleep(0.001)
    one = only(worker)
    os.kill(one.pid or 0, signal.SIGINT)
    assert first.result(timeout=60) == 9
    os.kill(one.pid or 0, signal.SIGINT)
    assert worker.submit(pow, 3, 2).result(timeout=60) == 9
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_whoever_works_is_ended_at_once() -> None:
    worker = Processes(1)
    pid(worker)
    one = only(worker)
    long, waiting = worker.submit(time.sleep, 3600.0), worker.submit(pow, 3, 2)
    while not long.running():
        time.sleep(0.001)
    worker.shutdown()
    with pytest.raises(BrokenExecutor):
        long.result(timeout=60)
    assert waiting.cancelled()
    assert one.exitcode == -signal.SIGKILL


def test_nothing_is_left_of_what_is_shut_down() -> None:
    worker = Processes(1)
    pid(worker)
    worker.shutdown()
    assert only(worker).exitcode == -signal.SIGKILL
    with pytest.raises(RuntimeError, match="after shutdown"):
        worker.submit(pow, 3, 2)


def test_nobody_else_reaches_a_process(worker: Processes) -> None:
    """Its socket has no address and listens to nobody."""
    pid(worker)
    ((_, line),) = worker.running.values()
    with socket.socket(fileno=os.dup(line.fileno())) as own:
        assert (own.family, own.getsockname(), own.getpeername()) == (socket.AF_UNIX, "", "")
        assert not own.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN)


def test_a_process_ends_with_the_one_that_waits_for_it(tmp_path: Path) -> None:
    """Whatever it does, and however that one ends."""
    script = tmp_path / "script.py"
    lines = ("import os, signal, time", "if __name__ == '__main__':", "    worker = Processes(1)")
    lines += (
        "    print(worker.submit(os.getpid).result(), flush=True)",
        "    long = worker.submit(time.sleep, 3600.0)",
    )
    lines += (
        "    while not long.running(): time.sleep(0.001)",
        "    os.kill(os.getpid(), signal.SIGKILL)",
    )
    script.write_text(START + "\n".join(lines))
    done = subprocess.run(
        [sys.executable, str(script)], stdout=subprocess.PIPE, text=True, timeout=60, check=False
    )
    assert done.returncode == -signal.SIGKILL
    until = time.monotonic() + 60.0
    while alive(int(done.stdout)) and time.monotonic() < until:
        time.sleep(0.01)
    assert not alive(int(done.stdout))


def test_a_script_that_its_processes_would_run_again_is_told(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(f"{START}print(Processes(1).submit(pow, 3, 2).result())\n")
    found = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=60, check=False
    )
    assert found.returncode == 1
    assert found.stderr.count("__main__") >= 2
    assert found.stderr.splitlines()[-1].endswith(
        "run the whole script again; put what the script does below that line"
    )


def test_what_lies_in_the_current_folder_is_not_imported(tmp_path: Path) -> None:
    """Neither by a process nor by the one of Python that watches over them."""
    script, folder = tmp_path / "script.py", tmp_path / "folder"
    script.write_text(
        f"{START}if __name__ == '__main__':\n    print(Processes(1).submit(pow, 3, 2).result())\n"
    )
    folder.mkdir()
    for name in ("multiprocessing", "pickle", "signal", "numpy", "fmbs_skfem"):
        (folder / f"{name}.py").write_text("open('imported', 'w').close()\n")
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in ("PYTHONSAFEPATH", "PYTHONPATH")
    }
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=folder,
        env=kept,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout, done.stderr) == ("9\n", "")
    assert not (folder / "imported").exists()


#: that Python has looked for beside its `-m` before this package is loaded, and the package
OF_PYTHON = [
    "importlib",
    "warnings",
    "contextlib",
    "collections",
    "keyword",
    "operator",
    "reprlib",
    "functools",
    "types",
    "fmbs_skfem",
]
#: every command, in the order in which they need each other
COMMANDS = """
--help
check cantilever.yaml
run cantilever.yaml --out run --html --checkpoint 0
check run
view run --html view.html
report run
resume run
reduce cantilever.yaml --out model.h5
rom info model.h5
rom run model.h5 --out rom --picture
rom export model.h5 --c c
rom export model.h5 --fmu model.fmu
train cantilever.yaml --out family
sweep cantilever.yaml --out sweep --samples 2 --workers 2
compare cantilever.yaml --out compare --quick
export cantilever.yaml --out vtk
render cantilever.yaml --out pictures --frames 2
part train cantilever.yaml --body beam --alone --runs 1 --samples 12 --duration 0.02
part info beam.part.h5
part check beam.part.h5 cantilever.yaml --body beam
new project
demo --copy
schema
verify --list
"""


def plant(folder: Path) -> set[str]:
    """Files with the names of all modules that there are, which leave a mark and fail where they
    are run; their names.
    """
    names = {*sys.stdlib_module_names, *(one.name for one in pkgutil.iter_modules())} - {
        "antigravity",
        "this",
    }
    for name in names:
        (folder / f"{name}.py").write_text(
            f"open('{name}.imported', 'w').close()\nraise ImportError\n"
        )
    return names


def call_beside(folder: Path, *start: str) -> tuple[int, set[str]]:
    """The exit code of a process that starts in a folder, and the modules that are imported from
    there.
    """
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"} | {
        "PYTHONPATH": str(SOURCE)
    }
    done = subprocess.run(
        [sys.executable, *start], cwd=folder, env=kept, capture_output=True, text=True, check=False
    )
    return done.returncode, {one.stem for one in folder.glob("*.imported")}


def script_of(folder: Path) -> str:
    """The program `fmbs` as it is installed: in a folder of its own."""
    script = folder / "bin" / "fmbs"
    script.parent.mkdir(parents=True, exist_ok=True)
    script.write_text(
        "from fmbs_skfem.cli.main import main\nif __name__ == '__main__':\n    main(prog_name='fmbs')\n"
    )
    return str(script)


def test_modules_beside_a_scene_are_not_imported(tmp_path: Path) -> None:
    """Of `python -m` those that Python itself imports are out of reach."""
    folder = tmp_path / "beside"
    folder.mkdir()
    assert len(plant(folder)) > 400
    assert call_beside(folder, script_of(tmp_path), "--help") == (0, set())
    for name in OF_PYTHON:
        (folder / f"{name}.py").unlink(missing_ok=True)
    assert call_beside(folder, "-m", "fmbs_skfem", "--help") == (0, set())


def test_no_command_imports_modules_beside_a_scene(tmp_path: Path) -> None:
    """Slow: all commands, with the processes that they start."""
    folder = tmp_path / "beside"
    folder.mkdir()
    path = scene(folder, "{type: dynamic, duration: 10 ms, step: 1 ms}")
    training = "{candidates: {design: sobol, count: 4}, samples: 2, iterations: 2, max_samples: 4, tolerance: 0.5, holdout: 1}"
    ranged = path.read_text().replace("load: 0.5 N", "load: {value: 0.5 N, range: [0.3 N, 0.6 N]}")
    ranged = ranged.replace("  clamp: {type: reaction, joint: clamp}\n", "")
    path.write_text(f"{ranged}reduction: {{snapshots: 1 ms}}\ntraining: {training}\n")
    plant(folder)
    found = {
        line: call_beside(folder, script_of(tmp_path), *line.split())
        for line in COMMANDS.strip().splitlines()
    }
    assert {line: names for line, (_, names) in found.items() if names} == {}
    assert {line: code for line, (code, _) in found.items() if code not in (0, 7)} == {}


def test_cores_are_those_of_affinity_and_quota(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(8)), raising=False)
    assert processes.cores(tmp_path) == 8
    (tmp_path / "cpu").mkdir()
    for quota, expected in (("-1", 8), ("250000", 3)):
        (tmp_path / "cpu" / "cpu.cfs_quota_us").write_text(f"{quota}\n")
        (tmp_path / "cpu" / "cpu.cfs_period_us").write_text("100000\n")
        assert processes.cores(tmp_path) == expected
    for quota, expected in (("max", 3), ("150000", 2), ("1600000", 3)):
        (tmp_path / "cpu.max").write_text(f"{quota} 100000\n")
        assert processes.cores(tmp_path) == expected
