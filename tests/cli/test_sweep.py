"""`fmbs sweep`: members of a scene and of a saved model, designs, folders, members that fail,
sweeps that go on.
"""

from __future__ import annotations

import ast
import csv
import errno
import functools
import json
import logging
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
import pytest
from distributed import LocalCluster

from fmbs_skfem import dynamics, reduction, scenes, studies, systems
from fmbs_skfem.core import extras
from fmbs_skfem.core.errors import InputError
from fmbs_skfem.families import parametric_model, prediction, response_surfaces, sweeps
from fmbs_skfem.families.members import Record
from fmbs_skfem.families.parametric_model import ParametricModel
from fmbs_skfem.reduction import affine
from fmbs_skfem.results import sweep_files
from fmbs_skfem.studies import sweeping

from ..hard_cases import alive
from .calls import EXAMPLES, ROOT, fmbs
from .test_examples import script

PENDULUM = """\
schema: 1
name: pendulum
dimension: 2
parameters:
  E: {value: 1 GPa, range: [0.7 GPa, 1.3 GPa]}
  d: 10 mm
  k: 2
bodies:
  beam:
    type: cable
    mesh: beam_20.msh
    line: beam
    section: {shape: circular, diameter: d}
    material: {young_modulus: E, density: 1800 kg/m^3}
joints:
  hinge: {type: revolute, at: beam.left, to: ground}
loads:
  weight: {type: gravity, acceleration: [0, -9.81 m/s^2]}
analysis: {type: dynamic, duration: 20 ms, step: 1 ms}
outputs:
  tip: {type: position, at: beam.right}
  energy: {type: energy}
"""


def test_sobol_indices_of_a_pendulum(tmp_path: Path) -> None:
    """E 0.7 to 1.3 GPa hardly moves a short swing, its length not at all: the weight alone decides;
    on threads of an executor.
    """
    text = PENDULUM.replace("  k: 2\n", "  k: 2\n  g: {value: 9.81, range: [5, 15]}\n").replace(
        "-9.81 m/s^2", "-g"
    )
    path = tmp_path / "pendulum.yaml"
    path.write_text(
        text.replace("mesh: beam_20.msh", "mesh: beam_5.msh").replace(
            "  energy: {type: energy}\n", ""
        )
    )
    shutil.copy(ROOT / "meshes" / "beam_5.msh", tmp_path)
    with ThreadPoolExecutor(2) as executor:
        found = studies.sweep(
            path,
            samples=64,
            design="saltelli",
            scheduler=executor,
            surfaces=True,
            out=tmp_path / "out",
        )
    assert found.report["ok"] == 64 * 4
    last = found.report["sobol_indices"]["tip_y"]["final"]
    for kind in ("first", "total"):
        assert 0.0 < last[f"{kind}_error"]["g"] < 0.3
        assert last[kind]["g"] == pytest.approx(1.0, abs=3.0 * last[f"{kind}_error"]["g"])
    assert abs(last["total"]["E"]) < 0.01
    assert "Sobol indices" in str(found)
    assert (tmp_path / "out" / "sensitivity.png").stat().st_size > 10_000
    check_surfaces(found, tmp_path / "out")
    with pytest.raises(InputError, match="at least 7 samples that run, for 2 parameters, got 6"):
        studies.sweep(path, samples=6, scheduler=executor, surfaces=True)
    with pytest.raises(InputError, match="no workers, scheduler and timeout beside it"):
        studies.sweep(path, samples=16, scheduler=executor, workers=2)


def check_surfaces(found: sweeping.SweepResult, out: Path) -> None:
    """A short swing is as deep as g is large, whatever E."""
    assert found.report["response_surfaces"]["tip_y"]["final"]["q2"] > 0.9999
    (y,), _ = found.surface("tip_y").predict({"E": 1e9, "g": 10.0})
    assert y == pytest.approx(
        response_surfaces.read(out / "surfaces.json")["tip_y"]["final"].predict([[1e9, 10.0]])[0][
            0
        ],
        rel=1e-9,
    )
    assert y == pytest.approx(
        2.0 * found.surface("tip_y").predict({"E": 1e9, "g": 5.0})[0][0], rel=1e-2
    )
    assert (out / "surfaces.png").stat().st_size > 10_000
    with pytest.raises(InputError, match="did you mean 'tip_y'"):
        found.surface("tip_yy")


@pytest.mark.skipif(sys.platform == "win32", reason="a shell script")
def test_the_batch_script_for_slurm(tmp_path: Path) -> None:
    """Stand-ins of the programs say what they are asked for: a scheduler, workers under srun, then
    the sweep with its address.
    """
    page = (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")
    job = tmp_path / "job.sh"
    job.write_text(page.split("```sh\n#!/bin/bash", 1)[1].split("```")[0].join(["#!/bin/bash", ""]))
    assert subprocess.run(["bash", "-n", job], check=False).returncode == 0
    both = "until grep -q dask said && grep -q srun said; do sleep 0.01; done"
    waits = {"dask": "exec sleep 3600", "srun": "exec sleep 3600", "fmbs": both}
    for name, wait in {**waits, "hostname": ""}.items():
        saying = (
            "echo node7"
            if name == "hostname"
            else f'echo $$ > {name}.number; echo "{name} $*" >> said'
        )
        (tmp_path / name).write_text(f"#!/bin/bash\n{saying}\n{wait}\n")
        (tmp_path / name).chmod(0o755)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "TMPDIR": str(tmp_path)}
    assert subprocess.run(["bash", job], cwd=tmp_path, env=environment, check=False).returncode == 0
    said = (tmp_path / "said").read_text()
    assert "dask scheduler --port 8786 --scheduler-file scheduler.json" in said
    assert "srun dask worker --scheduler-file scheduler.json" in said
    assert "--scheduler tcp://node7:8786" in said
    for name in ("dask", "srun"):  # the job ends what it began
        while alive(int((tmp_path / f"{name}.number").read_text())):
            time.sleep(0.01)


def test_jobs_of_slurm_are_those_that_the_page_shows() -> None:
    """What dask-jobqueue submits for the cluster of the page, but for the Python and the address of
    this machine.
    """
    slurm = pytest.importorskip("dask_jobqueue.slurm", reason="the extra slurm")
    page = (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")
    (code,) = [
        block.split("```")[0]
        for block in page.split("```python\n")[1:]
        if "SLURMCluster" in block.split("```")[0]
    ]
    made = ast.parse(code)
    (call,) = [
        node
        for node in ast.walk(made)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "SLURMCluster"
    ]
    (settings,) = [node.value for node in ast.walk(made) if isinstance(node, ast.Assign)]
    options = {
        one.arg: ast.literal_eval(settings if isinstance(one.value, ast.Name) else one.value)
        for one in call.keywords
    }
    job = slurm.SLURMJob(scheduler="tcp://10.0.0.17:8786", name="0", **options).job_script()
    shown = page.split("```sh\n#!/usr/bin/env bash", 1)[1].split("```")[0]
    assert f"#!/usr/bin/env bash{shown}".split() == job.replace(sys.executable, "python").split()


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A cluster of two processes for all tests."""
    with LocalCluster(
        2, threads_per_worker=1, dashboard_address=":0", silence_logs=logging.CRITICAL
    ) as cluster:
        yield cluster.scheduler_address


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scene")
    (folder / "beam_20.msh").write_bytes((ROOT / "meshes" / "beam_20.msh").read_bytes())
    path = folder / "pendulum.yaml"
    path.write_text(PENDULUM)
    return path


@pytest.fixture(scope="module")
def model(scene: Path) -> Path:
    """The family of the scene as one file."""
    parameters, family = scenes.family(scenes.read(scene), cells=4)
    return parametric_model.save(
        ParametricModel(affine.fit(family, parameters)), scene.with_name("pendulum.h5")
    )


def rows(out: Path) -> tuple[list[str], list[dict[str, str]]]:
    with (out / "sweep.csv").open(newline="") as file:
        reader = csv.DictReader(file)
        return list(reader.fieldnames or ()), list(reader)


def test_members_are_the_runs_of_the_scene(scene: Path, address: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    call = (
        "sweep",
        scene,
        "--samples",
        "3x2",
        "--design",
        "grid",
        "--range",
        "d=8 mm:12 mm:log",
        "--scheduler",
        address,
    )
    done = fmbs(*call, "--out", out, "--json")
    assert done.code == 0, done.err
    found = done.json
    assert (found["status"], found["members"], found["ok"], found["computed"]) == ("ok", 6, 6, 6)
    assert found["parameters"]["d"] == {
        "low": 8e-3,
        "high": 12e-3,
        "nominal": 1e-2,
        "unit": "m",
        "scale": "log",
    }
    assert json.loads((out / "report.json").read_text())["outputs"] == found["outputs"]
    head, table = rows(out)
    assert head[:6] == [
        "member",
        "E [Pa]",
        "d [m]",
        "tip_x min [m]",
        "tip_x max [m]",
        "tip_x final [m]",
    ]
    assert [(float(row["E [Pa]"]), float(row["d [m]"])) for row in table] == [
        (E, pytest.approx(d)) for E in (0.7e9, 1e9, 1.3e9) for d in (8e-3, 12e-3)
    ]
    changes = ("--set", "E=1.3e9", "--set", f"d={table[5]['d [m]']}")
    single = fmbs("run", scene, *changes, "--json", "--no-plots", "--out", tmp_path / "one").json[
        "outputs"
    ]
    for name in ("tip_x", "tip_y"):
        assert float(table[5][f"{name} final [m]"]) == pytest.approx(
            single[name]["final"], rel=1e-13
        )
    assert float(table[5]["energy_kinetic max [J]"]) == pytest.approx(
        single["energy_kinetic"]["max"], rel=1e-10
    )
    with h5py.File(out / "sweep.h5") as file:
        np.testing.assert_allclose(file["times"], np.arange(21) * 1e-3, atol=1e-15)
        assert file["histories/tip_y"].shape == (6, 21)
    for name in ("response.png", "scatter.png", "histories.png"):
        assert (out / name).read_bytes().startswith(b"\x89PNG")


def test_a_member_that_fails_is_listed(scene: Path, address: str, tmp_path: Path) -> None:
    """Exit code 5; the others are there."""
    points, out = tmp_path / "points.csv", tmp_path / "out"
    points.write_text("E [GPa]\n1\n-1\n1.2\n")
    call = ("sweep", scene, "--list", points, "--scheduler", address, "--out", out)
    done = fmbs(*call, "--json")
    assert done.code == 5
    found = done.json
    assert (found["status"], found["reason"], found["ok"]) == ("error", "failed samples", 2)
    (failed,) = found["failed"]
    assert (failed["member"], failed["values"], failed["status"], failed["reason"]) == (
        1,
        {"E": -1e9},
        "failed",
        "bad input",
    )
    assert "young_modulus" in failed["message"]
    assert "1 of 3 samples failed" in done.err
    assert [row["status"] for row in rows(out)[1]] == ["ok", "failed", "ok"]
    again = fmbs(*call, "--resume", "--no-plots")
    assert again.code == 5
    assert "0 computed" in again.out
    assert "bad input" in again.out


def test_a_sweep_that_is_cut_off_tells_where_its_numbers_come_from(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cut(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(sweeps, "run", cut)
    assert fmbs("sweep", scene, "--samples", "4", "--out", tmp_path / "out").code != 0
    found = json.loads((tmp_path / "out" / "report.json").read_text())
    assert found["status"] == "running"
    assert found["provenance"]["files"].keys() == {str(scene), str(scene.parent / "beam_20.msh")}
    assert found["provenance"]["threads"]["workers"] is None


def test_a_sweep_goes_on_and_another_one_is_refused(
    scene: Path, address: str, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    call = (
        "sweep",
        scene,
        "--samples",
        "4",
        "--scheduler",
        address,
        "--out",
        out,
        "--no-plots",
        "--json",
    )
    assert fmbs(*call).json["computed"] == 4
    first = (out / "members" / "000000.h5").read_bytes()
    refused = fmbs(*call)
    assert (refused.code, "--resume" in refused.err) == (3, True)
    (out / "members" / "000002.h5").unlink()
    (out / "members" / "000003.h5").write_bytes(first[:1000])
    resumed = fmbs(*call, "--resume")
    assert (resumed.code, resumed.json["computed"], resumed.json["ok"]) == (0, 2, 4)
    assert "000003.h5" in resumed.err
    assert (out / "members" / "000000.h5").read_bytes() == first
    for other in (
        ("--seed", "1"),
        ("--range", "E=0.8 GPa:1 GPa"),
        ("--duration", "0.01"),
        ("--instants", "5"),
        ("--set", "k=3"),
    ):
        assert fmbs(*call, *other, "--resume").code == 3, other
    assert (out / "members" / "000000.h5").read_bytes() == first
    assert fmbs(*call, "--force", "--seed", "1").json["computed"] == 4
    assert (out / "members" / "000000.h5").read_bytes() != first


def test_members_of_a_saved_model(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On processes of this machine, which need no extra; with fewer instants than steps."""
    for name in extras.PACKAGES["cluster"]:
        monkeypatch.setitem(sys.modules, name, None)
    out = tmp_path / "out"
    sizes = ("--samples", "5", "--design", "lhs", "--instants", "11", "--workers", "1")
    done = fmbs("sweep", model, *sizes, "--out", out, "--no-plots", "--json")
    assert done.code == 0, done.err
    rom = parametric_model.load(model)
    _, table = rows(out)
    assert len(table) == 5
    with h5py.File(out / "sweep.h5") as file:
        for k, (E,) in enumerate(file["parameters"][()]):
            motion = parametric_model.run(rom, np.arange(0, 21, 2), E=E)
            found = dynamics.outputs(motion)
            np.testing.assert_allclose(file["times"], motion.times)
            for name in ("tip_x", "tip_y"):
                np.testing.assert_array_equal(file[f"histories/{name}"][k], found[name])


def test_a_full_disk_ends_a_sweep(
    model: Path, address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, data: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    done = fmbs(
        "sweep",
        model,
        "--samples",
        "2",
        "--scheduler",
        address,
        "--out",
        tmp_path / "out",
        "--no-plots",
        "--json",
    )
    assert (done.code, done.json["reason"]) == (6, "limit reached")
    assert "room on the disk" in done.err
    assert "--resume" in done.err


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_ends_a_sweep_that_goes_on_later(
    number: int,
    code: int,
    scene: Path,
    address: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    write, call = (
        sweep_files.write,
        (
            "sweep",
            scene,
            "--samples",
            "60",
            "--scheduler",
            address,
            "--out",
            tmp_path / "out",
            "--json",
        ),
    )

    def told(folder: Path, record: Record) -> None:
        os.kill(os.getpid(), number)
        write(folder, record)

    # shells start background jobs that ignore it
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with monkeypatch.context() as patch:
            patch.setattr(sweep_files, "write", told)
            done = fmbs(*call)
    finally:
        signal.signal(signal.SIGINT, usual)
    assert done.code == code
    assert f"stopped by {signal.Signals(number).name} after" in done.err
    assert "--resume" in done.json["message"]
    there = len(list((tmp_path / "out" / "members").iterdir()))
    assert 0 < there < 60
    again = fmbs(*call, "--resume", "--no-plots")
    assert (again.code, again.json["computed"], again.json["ok"]) == (0, 60 - there, 60)


def test_a_trained_model_shows_its_surrogate(model: Path, address: str, tmp_path: Path) -> None:
    """The record of a training in the notes is all that the figure needs; without it there is none."""
    plain = fmbs(
        "sweep",
        model,
        "--samples",
        "2",
        "--scheduler",
        address,
        "--out",
        tmp_path / "plain",
        "--json",
    )
    assert not [name for name in plain.json["files"] if "surrogate" in name]
    unit = np.linspace(0.0, 1.0, 5)[:, None]
    notes: dict[str, object] = {prediction.DOUBTS: ["there is one full run only"]}
    notes[prediction.KEY] = {
        "samples": unit,
        "indicators": 1e-9 * 10 ** unit[:, 0],
        "pairs": np.array([[1e-9, 1e-6]]),
    }
    trained = parametric_model.save(
        ParametricModel(parametric_model.load(model).model, notes), tmp_path / "trained.h5"
    )
    out = tmp_path / "out"
    done = fmbs("sweep", trained, "--samples", "2", "--scheduler", address, "--out", out, "--json")
    assert done.code == 0, done.err
    (doubt,) = done.json["notices"]
    assert (
        doubt
        == "the error estimate of the model is not reliable: there is one full run only; check with full runs"
    )
    assert str(out / "surrogate.png") in done.json["files"]
    assert (out / "surrogate.png").read_bytes().startswith(b"\x89PNG")


def test_ranges_of_a_saved_model(model: Path, address: str, tmp_path: Path) -> None:
    call = (
        "sweep",
        model,
        "--samples",
        "2",
        "--design",
        "grid",
        "--scheduler",
        address,
        "--no-plots",
        "--json",
        "--out",
    )
    inside = fmbs(*call, tmp_path / "a", "--range", "E=0.9 GPa:1.1 GPa")
    assert inside.code == 0, inside.err
    assert inside.json["notices"] == []
    assert [float(row["E [Pa]"]) for row in rows(tmp_path / "a")[1]] == [0.9e9, 1.1e9]
    outside = fmbs(*call, tmp_path / "b", "--range", "E=0.9 GPa:2 GPa")
    assert outside.code == 0
    assert "outside its training in 1 of 2 samples: E from 9e+08 to 2e+09" in outside.err
    (table := tmp_path / "points.csv").write_text("E [GPa]\n0.9\n1.1\n3\n")
    listed = fmbs(
        "sweep",
        model,
        "--list",
        table,
        "--scheduler",
        address,
        "--no-plots",
        "--json",
        "--out",
        tmp_path / "d",
    )
    assert (listed.code, len(listed.json["notices"])) == (0, 1)
    assert (
        "outside its training in 1 of 3 samples: E from 9e+08 to 3e+09, trained from"
        in listed.json["notices"][0]
    )
    for wrong in (
        ("--range", "F=1:2"),
        ("--set", "F=1"),
        ("--range", "E=1 mm:2 mm"),
        ("--duration", "1"),
        ("--set", "E=1 GPa"),
    ):
        assert fmbs(*call, tmp_path / "c", *wrong).code == 3, wrong


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        ((), 3, "--samples: expected a number of samples"),
        (("--samples", "0"), 3, "--samples"),
        (("--samples", "3x2"), 3, "--design grid"),
        (("--samples", "3x2", "--design", "grid"), 3, "1 number(s) of values"),
        (
            ("--samples", "5", "--design", "grid", "--range", "d=8 mm:9 mm"),
            3,
            "the power 2 of a whole number",
        ),
        (("--samples", "4", "--range", "E=2 GPa:1 GPa"), 3, "--range E"),
        (("--samples", "4", "--range", "E=1 mm:2 mm"), 3, "--range E"),
        (("--samples", "4", "--range", "d=0:1 mm:log"), 3, "--range d"),
        (("--samples", "4", "--range", "dd=1:2"), 3, "did you mean 'd'"),
        (("--samples", "4", "--range", "E=1"), 2, "NAME=LOW:HIGH"),
        (("--samples", "4", "--set", "E=1 GPa"), 3, "a parameter with a range"),
        (("--samples", "4", "--design", "list"), 3, "--list"),
        (("--samples", "4", "--timeout", "0"), 3, "timeout"),
        (("--samples", "4", "--workers", "2", "--scheduler", "tcp://127.0.0.1:9"), 3, "workers"),
        (("--samples", "4", "--design", "halton"), 2, "halton"),
        (
            ("--samples", "4", "--design", "saltelli"),
            3,
            "at least 8 with --design saltelli, of which each is 3 runs, got 4",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(
    arguments: tuple[str, ...], code: int, text: str, scene: Path, tmp_path: Path
) -> None:
    done = fmbs("sweep", scene, *arguments, "--out", tmp_path / "out")
    assert (done.code, text in done.err) == (code, True), done.err
    assert not (tmp_path / "out").exists()


def test_the_example_is_as_accurate_as_it_predicts_and_goes_on(tmp_path: Path) -> None:
    """Coarse and short, with three full runs. Errors of displacements at the members against full
    runs at their parameters.
    """
    options = sweeps.SweepOptions(executor=ThreadPoolExecutor(2))
    call = functools.partial(
        script("sweep_pendulum"), tmp_path, duration=0.05, cells=8, full_runs=3, options=options
    )
    assert call(count=4)["members"] == 4
    rom = parametric_model.load(tmp_path / "pendulum.h5")
    _, family = scenes.family(
        scenes.read(EXAMPLES / "pendulum_family.yaml"), cells=8, duration=0.05
    )
    with h5py.File(tmp_path / "sweep.h5") as file:
        before, points = file["histories/C_z"][()], file["parameters"][()]
    for (E, d), history in zip(points, before, strict=True):
        case, motion = family({"E": E, "d": d}), parametric_model.run(rom, E=E, d=d)
        np.testing.assert_allclose(history, dynamics.outputs(motion)["C_z"], atol=1e-12)
        full = dynamics.integrate(
            systems.eliminate(case.system),
            case.scheme,
            case.duration,
            dynamics.Newton(tolerance=1e-12),
        )
        predicted = prediction.predicted_error(rom, E=E, d=d)
        assert predicted is not None
        assert predicted.low <= reduction.compare(full, motion).mean <= predicted.high
    assert call(count=6)["members"] == 6
    with h5py.File(tmp_path / "sweep.h5") as file:
        np.testing.assert_array_equal(file["histories/C_z"][:4], before)
