"""One BLAS thread, no window, one folder for what tests write, and a look whether anything can be drawn."""

from __future__ import annotations

import os

# before numpy and matplotlib are loaded, and for every child process
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
os.environ["MPLBACKEND"] = "Agg"
os.environ["FMBS_EXTENSIONS"] = "allow"
# commands in processes of their own start as they do for users: without bytecode each of them compiles the whole package
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import contextlib
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

#: files with tests of half a minute; the first ones compile nothing, while the other process compiles what all others need
LONG = ("test_project.py", "test_docs.py", "test_benchmarks.py", "test_registry.py")
FAST = ("core", "shapes", "bodies", "systems", "dynamics")  #: folders whose tests are marked `fast`


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """`pytest -m fast` takes the tests of the floors that most changes touch; long tests begin, so that no process ends alone."""
    items.sort(key=lambda item: LONG.index(item.path.name) if item.path.name in LONG else len(LONG))
    for item in items:
        if item.path.parent.name in FAST:
            item.add_marker(pytest.mark.fast)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """A file stays in one process, so that models which its tests share are made once."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False  # which would put files of few long tests last
    return LoadFileScheduling(config, log)


def pytest_collection_finish() -> None:
    """What was imported to find the tests stays: searches for garbage leave it out, and come less often, as in commands."""
    gc.freeze()
    gc.set_threshold(imports.YOUNG)


@pytest.fixture(scope="session", autouse=True)
def one_blas_thread() -> Iterator[None]:
    """Small systems are faster and their times comparable with one thread, also where numpy was loaded earlier."""
    with threadpoolctl.threadpool_limits(limits=1, user_api="blas"):
        yield


@pytest.fixture(scope="session", autouse=True)
def one_painter() -> Iterator[None]:
    """All pictures of this process are drawn by one, which loads VTK with the first of them."""
    with contextlib.closing(painter.Painter()) as one, pytest.MonkeyPatch.context() as patch:
        patch.setattr(painter, "AT_HAND", [one])
        yield


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
