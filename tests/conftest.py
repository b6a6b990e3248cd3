"""One BLAS thread, no window, one folder for what tests write, and a look whether anything can be
drawn.
"""

from __future__ import annotations

import os

# before numpy and matplotlib are loaded, and for every child process
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
os.environ["MPLBACKEND"] = "Agg"
os.environ["FMBS_EXTENSIONS"] = "allow"
# commands in processes of their own start as they do for users: without bytecode each of them
# compiles the whole package
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import gc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import threadpoolctl

from fmbs_skfem.core import imports
from fmbs_skfem.core.errors import MissingFeature
from fmbs_skfem.results import pictures
from fmbs_skfem.results.rendering import painter

from . import durations

COLLECTED = durations.Collected()


def pytest_addoption(parser: pytest.Parser) -> None:
    durations.add_options(parser)


def pytest_configure(config: pytest.Config) -> None:
    if config.option.all:
        durations.measure_caches()
        durations.measure_compilation(config.option.record)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    durations.choose(config, items)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    durations.METER.start()


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: Any, request: Any) -> Iterator[Any]:
    with durations.fixture(fixturedef, request):
        return (yield)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> None:
    if call.when == "teardown" and item.config.option.all:
        durations.note(item)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    COLLECTED.add(report)


def pytest_deselected(items: list[pytest.Item]) -> None:
    COLLECTED.left_out = len(items)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """A full run is over: the process that all others report to writes the file, or looks for what
    it does not list.
    """
    if hasattr(session.config, "workerinput"):
        session.config.workeroutput["left_out"] = COLLECTED.left_out  # type: ignore[attr-defined]
    elif session.config.option.all:
        seconds = COLLECTED.seconds()
        if session.config.option.record:
            durations.write(seconds)
        elif (
            session.exitstatus == pytest.ExitCode.OK
            and max(durations.unlisted(seconds).values(), default=0.0) > durations.FAIL
        ):
            session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    COLLECTED.left_out = getattr(node, "workeroutput", {}).get("left_out", 0)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """What a run has left out, and what a full run has found."""
    if COLLECTED.left_out:
        terminalreporter.write_line(f"tests left out: {COLLECTED.left_out} (--all takes all)")
    for test, spent in durations.unlisted(COLLECTED.seconds()).items():
        terminalreporter.write_line(
            f"{test} took {spent:.1f} s: make it quick, or list it by `pytest -n logical --all --record`"
        )


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """A file stays in one process, so that models which its tests share are made once."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False  # which would put files of few long tests last
    return LoadFileScheduling(config, log)


def pytest_collection_finish() -> None:
    """What was imported to find the tests stays: searches for garbage leave it out, and come less
    often, as in commands.
    """
    gc.freeze()
    gc.set_threshold(imports.YOUNG)


@pytest.fixture(scope="session", autouse=True)
def one_blas_thread() -> Iterator[None]:
    """Small systems are faster and their times comparable with one thread, also where numpy was
    loaded earlier.
    """
    with threadpoolctl.threadpool_limits(limits=1, user_api="blas"):
        yield


@pytest.fixture(scope="session", autouse=True)
def one_painter() -> Iterator[None]:
    """All pictures of this process are drawn by one, which loads VTK with the first of them; its
    end counts for no test.
    """
    one = painter.Painter()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(painter, "AT_HAND", [one])
        yield
    with durations.METER.apart(None):
        one.close()


@pytest.fixture(scope="session")
def output(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for files that several tests share."""
    return tmp_path_factory.mktemp("output")


@pytest.fixture(scope="session")
def opengl() -> None:
    """Skip where nothing can be drawn; that commands end well there is tested without OpenGL."""
    try:
        pictures.probe()
    except MissingFeature as error:
        pytest.skip(str(error))
