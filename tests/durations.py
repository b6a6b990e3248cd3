"""Which tests are slow, by a file that full runs write, and which of them a run takes.

    pytest                                quick tests: below SLOW seconds of CPU, or named in SMOKE
    pytest FILE::TEST, -k, -m             the tests that are named, slow ones too
    pytest --all                          all; fails where a test that the file does not list takes over FAIL seconds
    pytest --all --record                 all, and writes the file
    pytest --slow 2/6 --slow-in dynamics  of the slow ones the second sixth, and then those of a folder, up to --budget seconds

    seconds of a test = its own + sum over what it shares with others: seconds of that / number of tests that use it

Seconds are those of all threads and of child processes. Compilation of kernels, which are there
once on a machine, is left out; that of expressions of a test's own is not. What several tests
share, a fixture of a module or a function with a cache, is made by the first of them, whichever
that is.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import re
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

FILE = Path(__file__).with_name("durations.json")
SLOW = 0.4  #: a test that takes more CPU seconds is slow; five hundred between this and 1 s take a third of the time of all others
#: a test that is not listed and takes more is named at the end of a full run, or fails it [s]
NAMED, FAIL = (
    2.0,
    5.0,
)
LISTED = 0.3  #: what takes less is not worth a line of the file [s]
PROPERTY = "durations"
ALWAYS = {"tests/test_project.py::test_types"}  #: slow tests of every part
#: folders of the package -> folders of tests, where they have other names
TESTED_IN = {
    "contact": "systems",
    "control": "systems",
    "parts": "reduction",
    "families": "reduction",
    "pages": "web",
    "foreign": "shapes",
}
SMOKE = frozenset(  #: slow tests that every run takes: one of each kind of model, of study and of what leaves the program
    {
        "cli/test_demo.py::test_demo_says_the_gist_in_twelve_lines_of_a_terminal[False]",
        "cli/test_examples.py::test_a_controlled_arm_reduced",
        "cli/test_examples.py::test_a_deep_arch_falls_over_at_its_published_load",
        "cli/test_examples.py::test_a_frame_with_a_motor_is_reduced",
        "cli/test_main.py::test_the_module_is_the_command",
        "cli/test_main.py::test_what_is_compiled_runs_without_numba",
        "cli/test_part.py::test_an_accuracy_chooses_shape_functions_and_points[False]",
        "cli/test_provenance.py::test_every_report_says_where_its_numbers_come_from[compare]",
        "cli/test_reduce.py::test_the_exact_polynomial_of_plates_is_saved_and_runs_alone",
        "cli/test_streams.py::test_results_are_kept_where_nobody_reads_the_summary",
        "cli/test_sweep.py::test_members_are_the_runs_of_the_scene",
        "cli/test_sweep.py::test_members_of_a_saved_model",
        "cli/test_train.py::test_a_parameter_that_moves_geometry_makes_a_model",
        "dynamics/test_arclength.py::test_follower_forces_and_histories",
        "dynamics/test_near_states.py::test_becks_column_flutters",
        "exports/test_c_events.py::test_events_in_c_are_those_of_python[by a reaction]",
        "exports/test_c_files.py::test_the_source_is_clean_and_its_memory_sound[as it is]",
        "exports/test_fmu.py::test_sources_alone_build_and_load[3]",
        "exports/test_part_ports.py::test_a_part_moves_in_c_as_in_python[a beam with torsion]",
        "physics/test_crank_slider_independent.py::test_rigid_limit",
        "physics/test_example_1.py::test_error_of_the_step_over_the_whole_run",
        "physics/test_free_shells.py::test_pinched_cylinder",
        "physics/test_shells.py::test_thin_roof_does_not_lock",
        "physics/test_statics_published.py::test_the_thin_roof_snaps_back",
        "physics/test_torsion_beams.py::test_an_end_moment_rolls_a_beam_up[1-16-100.0-1e-06]",
        "reduction/test_comparison.py::test_example_2_at_component_level[hyper0-kept0]",
        "reduction/test_deim.py::test_deim_is_unstable_where_ecsw_is_not",
        "reduction/test_galerkin.py::test_modes_and_errors_of_example_2",
        "reduction/test_greedy_spin_up.py::test_true_errors_lie_in_the_predicted_band",
        "reduction/test_part_files.py::test_what_functions_leave_out_of_strains_is_known_and_said_where_forces_are_asked_for",
        "studies/test_accuracy.py::test_cells_of_equilibria_are_found[1e-4]",
        "studies/test_payoff.py::test_eps_and_eta_are_the_coarsest_for_the_accuracy[1e-4]",
        "systems/test_contacts.py::test_a_cable_falls_over_a_drum_and_is_held",
        "test_by_hand.py::test_the_package_computes_what_is_computed_by_hand",
        "test_docs.py::test_public_objects_say_what_they_are_with_shapes",
        "test_docs.py::test_tutorials_run_and_come_out_as_they_say",
        "test_project.py::test_every_third_party_import_is_declared",
        "verification/test_registry.py::test_case[pressure-cantilever]",
        "verification/test_registry.py::test_case[roll-up]",
        "verification/test_registry.py::test_case[sze-end-shear]",
        "web/test_page.py::test_a_saved_model_runs_in_its_page_as_in_python",
        "web/test_report.py::test_a_training_shows_its_model_and_is_reported",
    }
)


def add_options(parser: pytest.Parser) -> None:
    """Options of the selection."""
    group = parser.getgroup("slow tests")
    group.addoption("--all", action="store_true", help="slow tests too")
    group.addoption(
        "--record",
        action="store_true",
        help=f"write {FILE.name} with what each test took; needs --all",
    )
    group.addoption(
        "--slow", metavar="K/N", help="the K-th of N parts of the slow tests, and no quick ones"
    )
    group.addoption(
        "--slow-in",
        metavar="FOLDER,FOLDER",
        type=lambda text: text.split(","),
        default=[],
        help="with --slow: and those of these folders of the package",
    )
    group.addoption(
        "--budget",
        metavar="S",
        type=float,
        default=400.0,
        help="with --slow-in: CPU seconds that these may take",
    )


def read() -> dict[str, float]:
    """CPU seconds of the tests that the file lists, by their ids."""
    if not FILE.exists():
        return {}
    files = json.loads(FILE.read_text(encoding="utf-8"))
    return {
        f"tests/{file}::{test}": seconds
        for file, tests in files.items()
        for test, seconds in tests.items()
    }


def write(seconds: dict[str, float]) -> None:
    """The file of these tests; those of other files stay as they are listed."""
    done = {test.partition("::")[0] for test in seconds}
    others = {test: spent for test, spent in read().items() if test.partition("::")[0] not in done}
    files: dict[str, dict[str, float]] = defaultdict(dict)
    for test, spent in sorted({**others, **seconds}.items()):
        if spent >= LISTED:
            file, _, name = test.removeprefix("tests/").partition("::")
            files[file][name] = round(spent, 1)
    FILE.write_text(json.dumps(files, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def is_slow(test: str, seconds: dict[str, float]) -> bool:
    """Whether a test is left out of quick runs."""
    return seconds.get(test, 0.0) > SLOW and test.removeprefix("tests/") not in SMOKE


def is_named(config: pytest.Config) -> bool:
    """Whether the command line names tests, not only files."""
    return bool(config.option.keyword or config.option.markexpr) or any(
        "::" in one for one in config.args
    )


def choose(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark slow tests, deselect what this run leaves out, and sort the rest: the longest files
    first, so that none ends alone.
    """
    seconds = read()
    slow = [item for item in items if is_slow(item.nodeid, seconds)]
    for item in slow:
        item.add_marker(pytest.mark.slow)
    kept = {item.nodeid for item in items}
    if config.option.slow:
        kept = part_of({item.nodeid: seconds[item.nodeid] for item in slow}, config)
    elif not (config.option.all or is_named(config)):
        kept -= {item.nodeid for item in slow}
    left_out = [item for item in items if item.nodeid not in kept]
    totals: dict[Path, float] = defaultdict(float)
    for item in items:
        if item.nodeid in kept:
            totals[item.path] += seconds.get(item.nodeid, 0.05)
    items[:] = sorted(
        (item for item in items if item.nodeid in kept),
        key=lambda item: (-totals[item.path], str(item.path)),
    )
    if left_out:
        config.hook.pytest_deselected(items=left_out)


def part_of(slow: dict[str, float], config: pytest.Config) -> set[str]:
    """The tests of a part: whole files, parts of about equal length; then those of folders, as far
    as the budget goes.
    """
    found = re.fullmatch(r"(\d+)/([1-9]\d*)", config.option.slow)
    if found is None:
        raise pytest.UsageError(f"--slow: expected K/N, as 2/6, got {config.option.slow!r}")
    number, parts = map(int, found.groups())
    files: dict[str, list[str]] = defaultdict(list)
    for test in slow:
        files[test.partition("::")[0]].append(test)
    length = {file: sum(slow[test] for test in tests) for file, tests in files.items()}
    spent, share = [0.0] * parts, {}
    for file in sorted(files, key=lambda one: (-length[one], one)):
        share[file] = spent.index(min(spent))
        spent[share[file]] += length[file]
    kept = [file for file in files if share[file] == number % parts]
    touched = {TESTED_IN.get(folder, folder) for folder in config.option.slow_in}
    left = config.option.budget
    for file in sorted(files, key=lambda one: (length[one], one)):
        if file not in kept and file.split("/")[1] in touched and length[file] <= left:
            left -= length[file]
            kept.append(file)
    return {test for file in kept for test in files[file]} | (ALWAYS & set(slow))


def cpu() -> float:
    """Seconds of this process and of its children that have ended."""
    return sum(os.times()[:4])


class Meter:
    """What one process spends on tests, on what they share, and on compilation."""

    def __init__(self) -> None:
        self.within = [0.0]  #: seconds of what ran inside, by depth
        self.made: dict[str, float] = {}  #: seconds of what is shared, since the test began
        self.used: set[str] = set()  #: what is shared that the test used
        self.own_code = False  #: whether what compiles is of the test alone
        self.begin = cpu()

    def start(self) -> None:
        """A test begins."""
        self.within = [0.0]
        self.made = {}
        self.used = set()
        self.begin = cpu()

    @contextlib.contextmanager
    def apart(self, key: str | None) -> Iterator[None]:
        """What happens inside counts for `key`, or for nobody."""
        begin = cpu()
        self.within.append(0.0)
        try:
            yield
        finally:
            spent = cpu() - begin
            inner = self.within.pop()
            self.within[-1] += spent
            if key is not None:
                self.made[key] = self.made.get(key, 0.0) + spent - inner

    def own(self) -> float:
        """Seconds of the test alone."""
        return cpu() - self.begin - self.within[0]


METER = Meter()


def measure_caches() -> None:
    """Functions of tests with a cache, which are declared after this, count as shared."""
    cache = functools.cache

    def measured(function: Callable[..., Any]) -> Any:
        if not function.__module__.startswith("tests."):
            return cache(function)
        name = f"{function.__module__}.{function.__qualname__}"

        @cache
        def missed(*arguments: Any, **named: Any) -> Any:
            with METER.apart(key_of(arguments, named)):
                return function(*arguments, **named)

        def key_of(arguments: Any, named: Any) -> str:
            return f"{name}{arguments}{named or ''}"

        @functools.wraps(function)
        def found(*arguments: Any, **named: Any) -> Any:
            METER.used.add(key_of(arguments, named))
            return missed(*arguments, **named)

        found.cache_clear = missed.cache_clear  # type: ignore[attr-defined]
        return found

    functools.cache = measured  # type: ignore[assignment]


def measure_compilation(record: bool) -> None:
    """What compiles counts for nobody, but functions of a test's own expressions for it: they are
    compiled anew for the record.
    """
    from fmbs_skfem.core.compiling import jit, machine_code
    from fmbs_skfem.core.compiling.compilation import LAW

    callback, collection, read = jit.compile_callback, jit.without_collection, machine_code.read

    def measured(signature: Any, function: Callable[..., Any], apart: bool, name: str) -> Any:
        METER.own_code = name.startswith(LAW)
        try:
            return callback(signature, function, apart, name)
        finally:
            METER.own_code = False

    @contextlib.contextmanager
    def collected() -> Iterator[None]:
        with contextlib.nullcontext() if METER.own_code else METER.apart(None), collection():
            yield

    jit.compile_callback, jit.without_collection = measured, collected
    if record:
        machine_code.read = lambda path: None if path.name.startswith(LAW) else read(path)


def key_of(fixture: Any, item: pytest.Item) -> str:
    """A fixture by its place, its name and its parameter."""
    index = getattr(getattr(item, "callspec", None), "indices", {}).get(fixture.argname, "")
    return f"{fixture.baseid}::{fixture.argname}{index}"


@contextlib.contextmanager
def fixture(definition: Any, request: Any) -> Iterator[None]:
    """A fixture is set up: it is shared where it outlives one test."""
    if definition.scope == "function":
        yield
    else:
        item = request._pyfuncitem
        with METER.apart(key_of(definition, item)):
            yield


def note(item: pytest.Item) -> None:
    """At its end a test notes what it took, what it made for others, and what it used of that."""
    known = getattr(getattr(item, "_fixtureinfo", None), "name2fixturedefs", {})
    shared = {
        key_of(one[-1], item) for one in known.values() if one and one[-1].scope != "function"
    }
    item.user_properties.append((PROPERTY, [METER.own(), METER.made, sorted(METER.used | shared)]))


class Collected:
    """What all processes have noted."""

    def __init__(self) -> None:
        self.own: dict[str, float] = {}
        self.uses: dict[str, list[str]] = {}
        self.made: dict[str, list[float]] = defaultdict(list)
        self.left_out = 0  #: number of tests that this run does not take

    def add(self, report: pytest.TestReport) -> None:
        """The end of a test."""
        for name, value in report.user_properties:
            if name == PROPERTY and report.when == "teardown":
                own, made, used = value  # type: ignore[misc]
                self.own[report.nodeid] = own
                self.uses[report.nodeid] = used
                for key, spent in made.items():
                    self.made[key].append(spent)

    def seconds(self) -> dict[str, float]:
        """Of all tests. Where some users of what is shared are slow, the others bear it alone,
        until no more of them become so.
        """
        slow: dict[str, float] = {}
        while True:
            users: dict[str, int] = defaultdict(int)
            for test, used in self.uses.items():
                for key in used:
                    users[key] += test not in slow
            found = dict(slow)
            for test in self.uses.keys() - slow.keys():
                shares = [max(self.made[key], default=0.0) / users[key] for key in self.uses[test]]
                found[test] = self.own[test] + sum(shares)
            more = {test: spent for test, spent in found.items() if spent > SLOW}
            if more.keys() == slow.keys():
                return found
            slow = more


def unlisted(seconds: dict[str, float]) -> dict[str, float]:
    """Tests that take long and that the file does not list as slow."""
    listed = read()
    return {
        test: spent
        for test, spent in seconds.items()
        if spent > NAMED and listed.get(test, 0.0) <= SLOW
    }
