"""Python files of a scene: the recipes of docs/extensions.md, from a scene and from Python, and
what is refused.
"""

from __future__ import annotations

import importlib.util
import pickle
import py_compile
import re
import subprocess
import sys
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics, scenes, studies, systems
from fmbs_skfem.bodies import laws
from fmbs_skfem.control.monitors import Monitor
from fmbs_skfem.core.compiling import jit
from fmbs_skfem.core.errors import CorruptFile, InputError
from fmbs_skfem.core.notices import Notice, Remark
from fmbs_skfem.core.storage import container
from fmbs_skfem.families import parametric_model
from fmbs_skfem.reduction import files
from fmbs_skfem.reduction.hyper import hyper_reduction
from fmbs_skfem.reduction.plan import Plan
from fmbs_skfem.scenes import build, extensions, schema
from fmbs_skfem.scenes.analyses.analysis import Analysis
from fmbs_skfem.scenes.bodies import SceneBody
from fmbs_skfem.studies import job as jobs
from fmbs_skfem.studies import reducing
from fmbs_skfem.studies.running import compiling
from fmbs_skfem.systems.connections.constraint_laws import ConstraintLaw
from fmbs_skfem.systems.forces.force_laws import ForceLaw
from fmbs_skfem.systems.measures import probes

from .. import pages
from ..cli.calls import ROOT, Call, fmbs
from ..forgotten import forget
from ..robustness.inputs import BEAM, beam

PAGE = "docs/extensions.md"
SCENE = pages.blocks(PAGE, "yaml")[0]
BLOCKS = pages.blocks(PAGE)
NAMED = re.findall(r"my_\w+\.py", re.findall(r"extensions: (.*)", SCENE)[0])
FILES = {
    block.split("\n")[0].removeprefix("# "): block for block in BLOCKS if block.startswith("# my_")
}


@pytest.fixture(autouse=True)
def _apart(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What a test declares is forgotten after it."""
    monkeypatch.setattr(laws, "KNOWN", dict(laws.KNOWN))
    monkeypatch.setattr(container, "TYPES", dict(container.TYPES))
    for kind in (ConstraintLaw, ForceLaw):
        monkeypatch.setattr(kind, "makers", dict(kind.makers))
    yield from forget(
        monkeypatch,
        systems.connections.joints.Joint,
        systems.forces.loads.Load,
        probes.Probe,
        SceneBody,
        Analysis,
        Monitor,
    )


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """The scene of the page in a project with its files and mesh."""
    for name in ("scenes", "meshes"):
        (tmp_path / name).mkdir()
    (tmp_path / "meshes" / "beam_20.msh").write_bytes(
        (ROOT / "meshes" / "beam_20.msh").read_bytes()
    )
    for name, text in FILES.items():
        (tmp_path / "scenes" / name).write_text(text, encoding="utf-8")
    (tmp_path / "scenes" / "own.yaml").write_text(SCENE, encoding="utf-8")
    return tmp_path / "scenes" / "own.yaml"


def quiet(path: Path) -> schema.Scene:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Remark)
        return scenes.read(path)


def test_every_recipe_is_short() -> None:
    # a scene of their own, or none
    whole = {
        "my_rod.py",
        "my_periods.py",
        "my_wind.py",
        "my_hht.py",
        "my_fence.py",
    }
    assert set(FILES) - whole == {
        "my_joint.py",
        "my_track.py",
        "my_load.py",
        "my_force.py",
        "my_output.py",
        "my_law.py",
    }
    assert whole < set(FILES)
    assert all(block.count("\n") < 60 for block in BLOCKS)


def test_the_scene_is_sound_and_runs(project: Path, tmp_path: Path) -> None:
    """Every file is named, --strict does not mind; the table has the column, the plot its unit, the
    joint holds.
    """
    done = fmbs("check", project, "--strict", "--json")
    assert done.code == 0, done.err
    assert [note for note in done.json["notices"] if "runs the Python file" in note] == [
        f"runs the Python file {project.parent.resolve() / name}" for name in NAMED
    ]
    done = fmbs("run", project, "--out", tmp_path / "out", "--no-plots", "--json")
    assert done.code == 0, done.err
    table = np.genfromtxt(tmp_path / "out" / "outputs.csv", delimiter=",", names=True)
    assert table["length"][0] == pytest.approx(1.0, rel=1e-12)
    assert done.json["notices"] == []  # run once a process
    assert set(NAMED) <= {Path(name).name for name in done.json["provenance"]["files"]}


OWN = """\
schema: 1
name: own
dimension: 2
extensions: [my_rod.py, my_periods.py]
bodies:
  rod: {type: rod, a: [0, 0], b: [2 m, 0], mass: 3 kg}
joints: {pin: {type: pin, at: rod.a}}
loads: {spring: {type: torsion_spring, at: rod.frame, stiffness: 5 N m/rad}}
analysis: {type: periods, count: 1}
"""


def test_a_body_and_an_analysis(project: Path, tmp_path: Path) -> None:
    """A rod m, L on a pin with a spring k: the period 2 pi sqrt(m L^2 / 3 k); all commands take it,
    and say what it has not.
    """
    path = project.parent / "whole.yaml"
    path.write_text(OWN)
    done = fmbs("check", path, "--json")
    assert done.code == 0, done.err
    assert done.json["analysis"] == "periods"
    assert done.json["estimates"]["modes"] == 1
    assert done.json["mass"] == pytest.approx(3.0)
    done = fmbs("run", path, "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    assert done.json["periods_s"] == [
        pytest.approx(2 * np.pi * np.sqrt(3.0 * 4.0 / 3.0 / 5.0), rel=1e-9)
    ]
    assert (tmp_path / "out" / "periods.csv").read_text().startswith("mode,period_s\n1,")
    for command in ("render", "export"):
        done = fmbs(command, path, "--out", tmp_path / command)
        assert done.code == 3
        assert (
            "expected one that finds shapes, such as modes, got periods; use fmbs run" in done.err
        )
    path.write_text(OWN.replace("mass: 3 kg", "mass: 3 m"))
    with pytest.raises(
        InputError, match=r"whole.yaml:6: bodies.rod.mass: expected a mass \[kg\], got '3 m'"
    ):
        quiet(path)
    assert {"Rod", "Periods"} <= set(scenes.json_schema()["$defs"])


def test_outputs_that_an_own_analysis_names_do_something(project: Path) -> None:
    own = FILES["my_periods.py"].replace(
        "    count: Count = 3\n", '    count: Count = 3\n    output: str = ""\n'
    )
    (project.parent / "my_periods.py").write_text(own)
    path = project.parent / "whole.yaml"
    outputs = "outputs: {tip: {type: position, at: rod.b}, other: {type: position, at: rod.a}}\n"
    path.write_text(OWN.replace("count: 1}", "count: 1, output: tip}") + outputs)
    with pytest.warns(Notice) as shown:
        quiet(path)
    (said,) = (str(one.message) for one in shown if "outputs: do" in str(one.message))
    assert said.endswith(
        "whole.yaml:10: outputs: do nothing, an analysis of periods has none: other"
    )


ARM = """\
schema: 1
name: arm
dimension: 2
extensions: [my_hht.py]
parameters: {c: {value: 0.2 ms, range: [0.1 ms, 0.3 ms]}}
bodies:
  beam: {type: cable, mesh: ../meshes/beam_20.msh, section: {shape: given, EA: 200 N, EI: 20 N mm^2, rhoA: 0.1 kg/m}}
joints: {pin: {type: pin, at: beam.left}}
loads: {weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}}
damping: {stiffness: c}
analysis: {type: hht_motion, duration: 0.2 s, step: 2 ms, alpha: 0.3}
outputs: {tip: {type: position, at: beam.right}}
reduction: {snapshots: 4 ms, tolerance: 1e-10}
training: {candidates: 4, samples: 2, iterations: 1, holdout: 1}
"""


def test_a_scheme_is_kept_in_saved_models(project: Path, tmp_path: Path) -> None:
    """A saved model runs by the scheme that it was trained with, to the same digits, and is refused
    where that is not known.
    """
    path = project.parent / "arm.yaml"
    path.write_text(ARM)
    done = fmbs("reduce", path, "--out", tmp_path / "arm.h5", "--json")
    assert done.code == 0, done.err
    saved = files.read(tmp_path / "arm.h5")
    case, _ = files.case_of(saved)
    assert type(case.scheme).__name__ == "Hht"
    assert case.scheme.coefficients == (0.0, 0.3, 0.8, 1.3**2 / 4)
    found = studies.reduce(quiet(path)).reduced
    again = files.run(saved, every=np.round(found.times / 2e-3).astype(int))
    assert np.array_equal(again.x, found.x)
    done = fmbs("train", path, "--out", tmp_path / "box", "--no-plots", "--json")
    assert done.code == 0, done.err
    box = parametric_model.load(tmp_path / "box" / "model.h5")
    assert box.model.nominal.scheme == case.scheme
    del container.TYPES["Hht"]
    with pytest.raises(
        CorruptFile,
        match=r"notes\.scheme: .* unknown type Hht; import the Python file that declares it first",
    ):
        files.read(tmp_path / "arm.h5")


def test_a_motion_that_solves_by_itself_is_not_reduced(project: Path, tmp_path: Path) -> None:
    """What reduced models and families would leave out is refused."""
    heading = "def solve(self, system, advance=None, watch=None, resume=None)"
    own = f"\n    {heading}:\n        return super().solve(system, advance, watch, resume)\n"
    (project.parent / "my_own.py").write_text(FILES["my_hht.py"].replace("Hht", "Own") + own)
    path = project.parent / "arm.yaml"
    path.write_text(ARM.replace("my_hht.py", "my_own.py").replace("hht_motion", "own_motion"))
    for command in (["reduce"], ["train"], ["sweep", "--samples", 2], ["compare"]):
        done = fmbs(command[0], path, *command[1:], "--out", tmp_path / command[0])
        assert done.code == 3
        assert (
            "arm.yaml:11: analysis: expected a motion by the steps of its scheme, got own_motion"
            in done.err
        )


def test_a_scheme_needs_a_name_of_its_own() -> None:
    with pytest.raises(
        InputError, match="class System: expected a name of its own, got System, as fmbs_skfem"
    ):
        type("System", (dynamics.GeneralizedAlpha,), {})


def test_tables_are_written_as_they_are(project: Path, tmp_path: Path) -> None:
    """Also the first column of an analysis of one's own."""
    periods = FILES["my_periods.py"].replace(
        '"mode": np.arange(1, len(periods) + 1)', '"angle": np.array([0.785])'
    )
    (project.parent / "my_periods.py").write_text(periods)
    path = project.parent / "whole.yaml"
    path.write_text(OWN)
    done = fmbs("run", path, "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    assert (tmp_path / "out" / "periods.csv").read_text().startswith("angle,period_s\n0.785,")


def test_the_keys_are_checked(project: Path) -> None:
    text = project.read_text()
    for before, after, message in (
        (
            "stiffness: 5 N/m",
            "stiffness: 5 N",
            r"own.yaml:\d+: loads.strut.stiffness: expected a force per length \[N/m\], got '5 N' \(force\)",
        ),
        (
            "moment: 10 g m",
            "moment: 10 g",
            r"own.yaml:\d+: loads.motor.moment: expected a quantity \[kg m\], got '10 g' \(mass\)",
        ),
        (
            "semi_axes",
            "semi_axis",
            r"own.yaml:\d+: joints.rail.semi_axis: expected one of the keys .* did you mean 'semi_axes'",
        ),
        ("type: span", "type: spam", r"own.yaml:\d+: outputs.length.type: .* did you mean 'span'"),
        (
            "law: hardening",
            "law: hardning",
            r"own.yaml:\d+: bodies.beam.law: .* did you mean 'hardening'",
        ),
        (
            "{c: 40}",
            "{d: 40}",
            r"own.yaml:\d+: bodies.beam: body 'beam'.numbers: expected the numbers of the law: c",
        ),
        (
            "{c: 40}",
            "{c: 40, d: 2}",
            r"body 'beam'.numbers: expected numbers of the law hardening .*, got 'd'",
        ),
        (
            "b: beam.right",
            "b: bem.right",
            r"own.yaml:\d+: outputs.length.b: .* did you mean 'beam'",
        ),
        ("dimension: 2", "dimension: 3", r"own.yaml:\d+: joints.rail"),
    ):
        assert text.count(before) == 1
        project.write_text(text.replace(before, after))
        with pytest.raises(InputError, match=message):
            build.system(quiet(project))


def test_the_schema_has_them(project: Path) -> None:
    quiet(project)
    published = scenes.json_schema()
    semi_axes = published["$defs"]["EllipseGuide"]["properties"]["semi_axes"]
    assert semi_axes["description"] == "along x and y: a length [m] per coordinate"
    assert (
        "unbalance"
        in published["properties"]["loads"]["additionalProperties"]["discriminator"]["mapping"]
    )


def test_the_command_takes_files(project: Path) -> None:
    """For the schema of editors, and for saved models, which name no files."""
    done = fmbs("--extension", project.parent / "my_joint.py", "schema")
    assert done.code == 0, done.err
    assert "EllipseGuide" in done.json["$defs"]
    assert "warning: ran the Python file" in done.err
    done = fmbs("--extension", project.parent / "none.py", "schema")
    assert done.code == 3
    assert "none.py, which is not there" in done.err


def test_reduced_models_know_them(project: Path, tmp_path: Path) -> None:
    """The joint and the load are arrays in a saved model; the output is known by its word, and
    named where it is not.
    """
    full = build.system(quiet(project))
    motion = dynamics.integrate(full, dynamics.GeneralizedAlpha(5e-3), 0.05)
    V = np.linalg.qr(np.random.default_rng(0).normal(size=(full.size, 8)))[0]
    reduced = systems.change_coordinates(full, V, full.x0)
    path = files.save(reduced, tmp_path / "model.rom")
    loaded = files.load(path)
    x, v, a = (
        (part - start) @ V
        for part, start in ((motion.x, full.x0), (motion.v, 0.0), (motion.a, 0.0))
    )
    again = dynamics.outputs(replace(motion, system=loaded, x=x, v=v, a=a))["length"]
    assert again.shape == motion.times.shape
    assert again[0] == pytest.approx(dynamics.outputs(motion)["length"][0], rel=1e-12)
    assert probes.units("length", loaded.outputs["length"]) == ("m",)
    del probes.Probe.known["span"]
    with pytest.raises(
        Exception, match=r"outputs\.length\.kind: expected one of position.*, got 'span'"
    ):
        files.load(path)


def test_parameters_and_worker_processes(project: Path) -> None:
    """Another value of a parameter reads the scene again; what the file declares goes to another
    process by its module.
    """
    scene = quiet(project)
    assert scene.again({}).joints == scene.joints
    child = "import pickle, sys; print(pickle.load(sys.stdin.buffer).joints['rail'])"
    command = [sys.executable, "-W", "error", "-c", child]
    done = subprocess.run(command, input=pickle.dumps(scene), capture_output=True, check=False)
    assert done.stdout.decode().strip() == str(scene.joints["rail"]), done.stderr


def test_the_python_of_the_page_runs(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(project.parent)
    pages.run(PAGE, BLOCKS[-1:])


@pytest.mark.parametrize(
    "named, message",
    [
        ("[../../outside.py]", r"extensions\[0\]: .* stays in its parent folder"),
        ("[/tmp/my_joint.py]", r"extensions\[0\]: .* relative"),
        (
            "[nowhere.py]",
            r"extensions\[0\]: expected a Python file .*nowhere.py, which is not there",
        ),
        ("[own.yaml]", r"extensions\[0\]: expected a Python file \(\.py\)"),
        ("my_joint.py", r"extensions: expected a list of Python files"),
        (
            "[broken.py]",
            r"extensions\[0\]: expected a Python file that runs, got ZeroDivisionError in broken.py, line 2: division by zero",
        ),
        (
            "[twice.py]",
            r"expected a word of its own, got 'guide', which is that of fmbs_extension_",
        ),
        ("[bare.py]", r"class Bare: expected a dataclass"),
        ("[half.py]", r"class Half: expected the methods constrain, got none of these"),
    ],
)
def test_refused(project: Path, named: str, message: str) -> None:
    (project.parent / "broken.py").write_text("a = 1\nb = a / 0\n")
    head = "from fmbs_skfem.systems.connections.joints import Joint\n"
    (project.parent / "twice.py").write_text(
        head + "class Guide(Joint):\n    pass\nclass Other(Joint, word='guide'):\n    pass\n"
    )
    (project.parent / "bare.py").write_text(
        head + "class Bare(Joint):\n    name: str\n    def constrain(self, draft): ...\n"
    )
    half = "from dataclasses import dataclass\n\n@dataclass(frozen=True)\nclass Half(Joint):\n    name: str\n"
    (project.parent / "half.py").write_text(head + half)
    project.write_text(
        SCENE.replace(
            "[my_joint.py, my_track.py, my_load.py, my_force.py, my_output.py, my_law.py]", named
        )
    )
    with pytest.raises(InputError, match=message):
        quiet(project)


TAKEN = """\
from dataclasses import dataclass
from typing import Annotated, ClassVar

from fmbs_skfem.extend import At, HyperReduction, Joint, Load, Probe, Rule, fields, own_laws, quantity, register


@dataclass(frozen=True)
class Height(Probe, word="position"):
    unit: ClassVar[str] = "m"
    at: Annotated[At, fields.PLACE]

    def sense(self, name, draft):
        return self.output(draft, (f"{name}_height",), [draft.layout.read(name, self.at)[1:2]])

    @staticmethod
    def evaluate(output, sensed):
        return [sensed.values[:, 0]]


@dataclass(frozen=True)
class Wind(Load, word="gravity"):
    name: str
    speed: Annotated[float, quantity("m/s")]

    def push(self, draft):
        pass


@register
@dataclass(frozen=True)
class All(HyperReduction):
    name: ClassVar[str] = "points"
    label: ClassVar[str] = "all"

    def train(self, runs):
        return Rule(lambda system: system)


own_laws.define("EXACT", 2, ("EA", "EI", "kappa0"), lambda r, EA, EI, kappa0: EA / 8 * (r[0].dot(r[0]) - 1) ** 2)
"""
WITH_TAKEN = """\
schema: 1
dimension: 2
extensions: [taken.py]
bodies:
  bar:
    type: cable
    mesh: ../meshes/beam_20.msh
    section: {shape: given, EA: 1 kN, EI: 0.1 N m^2, rhoA: 0.1 kg/m}
    law: EXACT
joints: {hinge: {type: pin, at: bar.left}}
loads: {wind: {type: gravity, speed: 3 m/s}}
outputs: {tip: {type: position, at: bar.right}}
analysis: {type: dynamic, duration: 10 ms, step: 1 ms}
reduction: {snapshots: 1 ms, hyper_reduction: {sample: points}}
"""


SCENE_OF_THE_PACKAGE = (
    WITH_TAKEN.replace("extensions: [taken.py]\n", "")
    .replace("    law: EXACT\n", "")
    .replace("speed: 3 m/s", "acceleration: [0, -9.81 m/s^2]")
)


def test_words_that_the_package_has_as_well_are_those_of_the_file(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the scene that lists it, with one remark; in another one of the same process they are the
    package's.
    """
    known = hyper_reduction.KNOWN
    monkeypatch.setitem(known, "points_of_taken", None)  # forgotten after the test
    (project.parent / "taken.py").write_text(TAKEN)
    project.write_text(WITH_TAKEN)
    other = project.with_name("other.yaml")
    other.write_text(SCENE_OF_THE_PACKAGE)
    for _ in range(2):
        with pytest.warns(Remark) as told:
            scene = scenes.read(project)
        said = "'EXACT', 'gravity', 'points', 'position' are those of taken.py, not of the package"
        assert sum(f"own.yaml:3: extensions: {said}" in str(one.message) for one in told) == 1
        system = build.system(scene)
        assert system.outputs["tip"].columns == ("tip_height",)
        assert probes.kind_of(system.outputs["tip"]) is type(scene.outputs["tip"])
        assert not system.loads.constant.any()
        assert system.elastic[0].gather.law is not laws.Law.EXACT
        assert known[scene.reduction.hyper_reduction.sample].label == "all"
        assert scene.again({}).outputs == scene.outputs
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            plain = scenes.read(other)
        assert build.system(plain).outputs["tip"].columns == ("tip_x", "tip_y")
        assert build.system(plain).loads.constant.any()
        assert known[plain.reduction.hyper_reduction.sample].label == "ecsw-points"


def test_a_sampling_of_the_scene_is_one_of_the_command(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its file has not been run when options are read."""
    monkeypatch.setitem(hyper_reduction.KNOWN, "all_of_mine", None)  # forgotten after the test
    del hyper_reduction.KNOWN["all_of_mine"]
    (project.parent / "taken.py").write_text(
        TAKEN.partition("own_laws.define")[0].replace('"points"', '"all_of_mine"')
    )
    project.write_text(WITH_TAKEN.replace("    law: EXACT\n", ""))
    seen = list[str]()

    def stop(job: jobs.Job, scene: schema.Scene, path: Path, plan: Plan, goal: None) -> None:
        seen.append(plan.hyper.name)
        raise InputError("stopped")

    monkeypatch.setattr(reducing, "reduce_scene", stop)
    done = fmbs("reduce", project, "--sample", "all_of_mine", "--out", project.parent / "out")
    assert (done.code, seen) == (3, ["all_of_mine"]), done.err
    done = fmbs("reduce", project, "--sample", "all_of_min", "--out", project.parent / "out")
    assert done.code == 3
    assert "--sample: expected one of none, elements, points, exact, " in done.err
    assert "got 'all_of_min'; did you mean 'all_of_mine'?" in done.err


def test_the_switch_refuses_all(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FMBS_EXTENSIONS", "refuse")
    with pytest.raises(
        InputError,
        match=r"own.yaml:4: extensions: expected consent to run Python files, got none for /",
    ):
        scenes.read(project)
    assert "ellipse_guide" not in systems.connections.joints.Joint.known


@pytest.mark.parametrize("command", ["check", "run", "reduce", "compare", "sweep"])
def test_nothing_runs_without_consent(
    project: Path, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    """Exit code 3 names the file and the call that allows it; that call runs it."""
    monkeypatch.delenv("FMBS_EXTENSIONS")
    trace = project.parent / "executed"
    for name in FILES:
        (project.parent / name).write_text(f"open({str(trace)!r}, 'w')\n" + FILES[name])
    done = fmbs(command, project, "--json", "--out", project.parent / "out")
    assert done.code == 3
    assert not trace.exists()
    assert f"got none for {project.parent.resolve() / 'my_joint.py'}" in done.json["message"]
    assert "--allow-extensions (in Python extensions='allow')" in done.json["message"]
    assert fmbs("check", project, "--allow-extensions", "--json").code == 0
    assert trace.exists()


@pytest.mark.parametrize("word", ["alow", "", "1"])
def test_another_word_for_consent_is_refused(
    project: Path, monkeypatch: pytest.MonkeyPatch, word: str
) -> None:
    with pytest.raises(
        InputError, match=f"extensions: expected one of allow, ask, refuse, got '{word}'"
    ):
        scenes.read(project, extensions=word)
    monkeypatch.setenv("FMBS_EXTENSIONS", word)
    with pytest.raises(
        InputError,
        match=f"environment: FMBS_EXTENSIONS: expected one of allow, ask, refuse, got '{word}'",
    ):
        scenes.read(project)


def test_consent_of_a_call_goes_before_the_environment(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FMBS_EXTENSIONS", "refuse")
    with pytest.warns(Remark, match="runs the Python file"):
        assert scenes.read(project, extensions="allow").extensions
    extensions.RUN.clear()
    with pytest.raises(InputError, match="consent"):
        scenes.read(project.with_name("own.yaml"), extensions="refuse")


def test_an_answer_at_a_terminal_is_remembered_by_content(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One question for all files, once; a file that has changed is asked for again."""
    monkeypatch.setenv("FMBS_EXTENSIONS", "ask")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(project.parent / "config"))
    shell = f"import pty, sys; sys.exit(pty.spawn([{sys.executable!r}, '-m', 'fmbs_skfem', 'check', {str(project)!r}]) >> 8)"

    def check(answers: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", shell],
            input=answers,
            capture_output=True,
            text=True,
            timeout=120,
        )

    refused = check("n\n")
    assert refused.returncode == 3, refused.stdout
    assert refused.stdout.count("[y/N]") == 1
    allowed = check("y\n")
    assert allowed.returncode == 0, allowed.stdout
    again = check("")
    assert again.returncode == 0
    assert "[y/N]" not in again.stdout
    with (project.parent / "my_load.py").open("a") as file:
        file.write("\nX = 1\n")
    changed = check("n\n")
    assert changed.returncode == 3
    assert changed.stdout.count("[y/N]") == 1


def test_bytecode_beside_a_file_is_not_run(project: Path) -> None:
    """Consent is to what can be read: a __pycache__ that came with the folder may hold anything
    else.
    """
    path, trace = project.parent / "my_load.py", project.parent / "executed"
    source = path.read_text()
    path.write_text(f"open({str(trace)!r}, 'w')\n" + source)
    beside, unchecked = (
        importlib.util.cache_from_source(str(path)),
        py_compile.PycInvalidationMode.UNCHECKED_HASH,
    )
    py_compile.compile(str(path), beside, invalidation_mode=unchecked)
    path.write_text(source)
    quiet(project)
    assert not trace.exists()


def test_no_module_of_the_current_folder_runs(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On an empty cache a process beside the run compiles: it imports the package, not what is
    called so in the current folder.
    """
    folder = project.parent / "here"
    folder.mkdir()
    for name in ("fmbs_skfem.py", "numba.py", "multiprocessing.py"):
        (folder / name).write_text(f"open({str(folder / 'executed')!r}, 'w')\n")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder / "cache"))
    monkeypatch.chdir(folder)
    calls: list[list[str]] = []

    class Recorded(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, command: list[str], **options: object) -> None:
            calls.append(command)
            # what it imports first, without the work
            super().__init__([*command[:-1], "fmbs_skfem.core.errors"], **options)

    jit.cache_folder.cache_clear()
    monkeypatch.setattr(compiling.subprocess, "Popen", Recorded)
    try:
        with jobs.begin(project) as job:
            assert compiling.announce(job)
        assert compiling._BESIDE.pop().wait(60) == 0
    finally:
        jit.cache_folder.cache_clear()
    assert calls
    assert not (folder / "executed").exists()


def test_a_changed_file_is_refused(project: Path) -> None:
    quiet(project)
    with (project.parent / "my_load.py").open("a") as file:
        file.write("\nX = 1\n")
    with pytest.raises(InputError, match="a file that stays the same while it is in use"):
        scenes.read(project)


#: what a file of a user's own declares and does wrong, and what a scene says of it; the wrong line
#: is marked
WRONG = {
    "a force": (
        "@force(compiled=False)\ndef broken(t, at: fields.Place):\n    'x'\n    raise RuntimeError('too late')  # here\n",
        "loads: {b: {type: broken, at: beam.right}}",
    ),
    "symbols": (
        "@force\ndef broken(at: fields.Place):\n    'x'\n    return [(at.position, at.colour)]  # here\n",
        "loads: {b: {type: broken, at: beam.right}}",
    ),
    "a joint": (
        "@dataclass(frozen=True)\nclass Broken(Joint):\n    'x'\n    name: str\n    at: fields.Place\n"
        "    def constrain(self, draft):\n        return draft.nothing  # here\n",
        "joints: {b: {type: broken, at: beam.left}}",
    ),
    "an output": (
        "@dataclass(frozen=True)\nclass Broken(Probe):\n    'x'\n    at: fields.Place\n    unit: ClassVar[str] = 'm'\n"
        "    def sense(self, name, draft):\n        return self.output(draft, (name,), [draft.layout.read('b', self.at)])\n"
        "    @staticmethod\n    def evaluate(output, sensed):\n        return [1 / 0]  # here\n",
        "outputs: {b: {type: broken, at: beam.right}}",
    ),
    "an analysis": (
        "@dataclass(frozen=True)\nclass Broken(History):\n    'x'\n    duration: Time\n    constraints: Form = None\n"
        "    label, scheme = 'x', None\n"
        "    def work(self): ...\n    def instants(self):\n        return np.zeros(1)\n"
        "    def solve(self, system, advance=None, watch=None, resume=None):\n        return {}['x']  # here\n",
        "analysis: {type: broken, duration: 1 s}",
    ),
    "a field that lacks": (
        "@dataclass(frozen=True)\nclass Broken(History):\n    'x'\n    duration: Time\n    def work(self): ...\n"
        "    def instants(self):\n        return np.zeros(1)\n    def solve(self, *more): ...\n",
        "analysis: {type: broken, duration: 1 s}",
    ),
}
#: what a file returns that is of no use, with what the scene says of it
USELESS = {
    "no pairs": (
        "@force(compiled=False)\ndef broken(t, at: fields.Place):\n    'x'\n    return 1.0\n",
        "loads: {b: {type: broken, at: beam.right}}",
        "own.py, class broken: expected values of the kind that its base asks for, got TypeError: 'float' object is not iterable",
    ),
    "an exit": (
        "@force(compiled=False)\ndef broken(t, at: fields.Place):\n    'x'\n    raise SystemExit(0)\n",
        "loads: {b: {type: broken, at: beam.right}}",
        "own.py, line 19: expected a Python file that runs, got SystemExit: 0",
    ),
    "a text as energy": (
        "@force(energy=True)\ndef broken(at: fields.Place):\n    'x'\n    return 'x'\n",
        "loads: {b: {type: broken, at: beam.right}}",
        "energy: expected a real expression of its arguments, got 'x'",
    ),
    "a force of something unknown": (
        "@force(energy=True)\ndef broken(at: fields.Place):\n    'x'\n    import sympy\n    return sympy.Symbol('q')\n",
        "loads: {b: {type: broken, at: beam.right}}",
        "expected expressions of its arguments, got q in them",
    ),
    "a complex row": (
        "@dataclass(frozen=True)\nclass Broken(OwnJoint):\n    'x'\n    name: str\n    at: fields.Place\n"
        "    @staticmethod\n    def equations(at):\n        return {'a': 1j}\n",
        "joints: {b: {type: broken, at: beam.left}}",
        "class Broken: 'a': expected a real expression of its arguments, got 1j",
    ),
    "a coefficient": (
        "@dataclass(frozen=True)\nclass Broken(Joint):\n    'x'\n    name: str\n    at: fields.Place\n"
        "    def constrain(self, draft):\n        draft.constraints.row(self.name, 'c', (float('nan'), -1, 0, 0))\n",
        "joints: {b: {type: broken, at: beam.left}}",
        "joint 'b'.c: expected terms of a finite coefficient, and numbers of a signal and of rows i, j, or -1, got (nan, -1, 0, 0)",
    ),
    "a row that there is not": (
        "@dataclass(frozen=True)\nclass Broken(Joint):\n    'x'\n    name: str\n    at: fields.Place\n"
        "    def constrain(self, draft):\n        draft.constraints.row(self.name, 'c', (1.0, -1, 99, -1))\n",
        "joints: {b: {type: broken, at: beam.left}}",
        "signals and 2 rows, got signal -1, rows 99 and -1",
    ),
    "a row of a load": (
        "@dataclass(frozen=True)\nclass Broken(Load):\n    'x'\n    name: str\n    at: fields.Place\n"
        "    def push(self, draft):\n        draft.forces.dead([99], [1.0])\n",
        "loads: {b: {type: broken, at: beam.right}}",
        "law 'dead': expected numbers of the 4 rows that there are, got rows [99]",
    ),
    "a number as function of time": (
        "@dataclass(frozen=True)\nclass Broken(Load):\n    'x'\n    name: str\n    at: fields.Place\n"
        "    def push(self, draft):\n        draft.signal(2.0)\n",
        "loads: {b: {type: broken, at: beam.right}}",
        "signal: expected a function of time, got 2.0",
    ),
    "one value": (
        "@dataclass(frozen=True)\nclass Broken(Probe):\n    'x'\n    at: fields.Place\n    unit: ClassVar[str] = 'm'\n"
        "    def sense(self, name, draft):\n        return self.output(draft, (name,), [draft.layout.read('b', self.at)])\n"
        "    @staticmethod\n    def evaluate(output, sensed):\n        return [3.0]\n",
        "outputs: {b: {type: broken, at: beam.right}}",
        "output 'b': evaluate: expected 11 numbers a column, one an instant, got an array () of float64",
    ),
    "a unit": (
        "@dataclass(frozen=True)\nclass Broken(Probe):\n    'x'\n    at: fields.Place\n    unit: ClassVar[str] = {}\n"
        "    def sense(self, name, draft):\n        return self.output(draft, (name,), [draft.layout.read('b', self.at)])\n"
        "    @staticmethod\n    def evaluate(output, sensed):\n        return [sensed.values[:, 0]]\n",
        "outputs: {b: {type: broken, at: beam.right}}",
        "output 'b': unit: expected a text such as 'm', got ({},)",
    ),
    "coefficients": (
        "@dataclass(frozen=True)\nclass Own(GeneralizedAlpha):\n    'x'\n    @property\n    def coefficients(self):\n"
        "        return 0.0, 0.1, float('nan'), 0.3\n"
        "@dataclass(frozen=True, kw_only=True)\nclass Broken(Dynamic):\n    'x'\n    @property\n    def scheme(self):\n"
        "        return Own(self.step)\n",
        "analysis: {type: broken, duration: 10 ms, step: 1 ms}",
        "class Own.coefficients: expected four finite numbers alpha_m < 1, alpha_f < 1, gamma > 0, beta > 0, got (0.0",
    ),
}
HEAD = """\
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fmbs_skfem.core.fields import Time
from fmbs_skfem.dynamics import GeneralizedAlpha
from fmbs_skfem.scenes.analyses import Form, History
from fmbs_skfem.scenes.dynamic import Dynamic
from fmbs_skfem.systems import fields
from fmbs_skfem.systems.force_functions import force
from fmbs_skfem.systems.joints import Joint
from fmbs_skfem.systems.loads import Load
from fmbs_skfem.systems.own_joints import OwnJoint
from fmbs_skfem.systems.probes import Probe
"""


def run_with(folder: Path, content: str, section: str) -> Call:
    """`fmbs run` of the beam with a file of a user's own, and a section of the scene in place of
    its own one.
    """
    (folder / "own.py").write_text(HEAD + content)
    name = section.partition(":")[0]
    text = re.sub(rf"^{name}:.*\n(  .*\n)*", "", BEAM, flags=re.MULTILINE)
    path = beam(folder, f"{text}\n{section}\nextensions: [own.py]\n")
    return fmbs("run", path, "--no-plots", "--out", folder / "out")


@pytest.mark.parametrize("kind", USELESS)
def test_what_is_returned_and_of_no_use_is_refused(kind: str, tmp_path: Path) -> None:
    content, section, message = USELESS[kind]
    done = run_with(tmp_path, content, section)
    assert done.code == 3, done.err
    assert message in done.err
    assert "internal error" not in done.err


@pytest.mark.parametrize("kind", WRONG)
def test_errors_of_ones_own_are_told_with_file_and_line(kind: str, tmp_path: Path) -> None:
    """Exit code 3, and no word of an internal error of the package."""
    content, section = WRONG[kind]
    done = run_with(tmp_path, content, section)
    lines = [
        f"line {k}"
        for k, row in enumerate((HEAD + content).splitlines(), 1)
        if row.endswith("# here")
    ]
    assert done.code == 3, done.err
    assert (
        f"{tmp_path / 'own.py'}, {(lines or ['class Broken'])[0]}: expected a Python file that runs, got "
        in done.err
    )
    assert "internal error" not in done.err
