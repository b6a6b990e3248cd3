"""The reduced model of a parameter range as a file: the same bits back, in three lines, and damage
of every kind.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmbs_skfem import dynamics
from fmbs_skfem.bodies import sections
from fmbs_skfem.core.errors import CorruptFile, InputError
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.storage import container
from fmbs_skfem.core.values.expressions import of_time
from fmbs_skfem.dynamics import GeneralizedAlpha, Newton, integrate
from fmbs_skfem.families import parametric_model
from fmbs_skfem.families.parametric_model import ParametricModel
from fmbs_skfem.reduction import affine, files
from fmbs_skfem.reduction.cases import Case
from fmbs_skfem.reduction.parameters import Parameter, Scale
from fmbs_skfem.reduction.spaces import component, galerkin
from fmbs_skfem.systems import At, System
from fmbs_skfem.systems.forces import loads
from tests import models
from tests.hard_cases import check_damage_is_found
from tests.reduction.test_files import same

SCHEME, DURATION = GeneralizedAlpha(2e-3), 0.1
BOX = (
    Parameter("E", 5e8, 2e9, Scale.LOG, "Pa", 1e9),
    Parameter("force", -1.0, 1.0, unit="N", value=0.5),
)


def raw(values: Mapping[str, float]) -> System:
    """A cantilever with a force at its tip that rises in time."""
    history = of_time("1 - exp(-t / 0.02)")
    material = sections.Material(values["E"], 1800.0)
    force = (0.0, values["force"])

    def pull(tip: At) -> list[loads.PointForce]:
        return [loads.PointForce("tip", tip, force, history)]

    system = models.cantilever(
        4, pull, section=models.SECTION, material=material, all_multipliers=True
    )
    return replace(system, outputs={"tip": system.outputs["tip"]})


@pytest.fixture(scope="module")
def rom() -> ParametricModel:
    full = raw({"E": 1e9, "force": 1.0})
    data = galerkin.snapshots(integrate(full, SCHEME, DURATION, Newton(1e-12)))
    components = component.system_level(full)
    bases = galerkin.bases(full, data, components, 1e-10)
    model = affine.fit(
        lambda values: Case(
            galerkin.reduce_system(raw(values), components, bases), SCHEME, DURATION
        ),
        BOX,
    )
    return ParametricModel(
        model,
        {"scene": "cantilever", "training": {"E": (1e9,), "force": (1.0,)}, "errors": [1e-5, 2e-5]},
    )


@pytest.fixture
def saved(rom: ParametricModel, tmp_path: Path) -> Path:
    return parametric_model.save(rom, tmp_path / "cantilever.rom")


def test_three_lines(rom: ParametricModel, saved: Path) -> None:
    loaded = parametric_model.load(saved)
    motion = parametric_model.run(loaded, E=5.5e8)
    found = dynamics.outputs(motion)
    case = rom.model({"E": 5.5e8, "force": 0.5})
    expected = dynamics.outputs(integrate(case.system, SCHEME, DURATION))
    assert len(motion.times) == 51
    assert abs(found["tip_y"][-1] - found["tip_y"][0]) > 1e-2
    assert same(found, expected)
    assert np.array_equal(parametric_model.run(loaded, 10, E=5.5e8).x, motion.x[::10])


def test_everything_comes_back(rom: ParametricModel, saved: Path) -> None:
    loaded = parametric_model.load(saved)
    assert same(loaded.model, rom.model)
    versions = loaded.notes.pop("versions")
    assert set(versions) == set(parametric_model.LIBRARIES)
    assert same(loaded.notes, rom.notes)
    for values in ({"E": 6e8, "force": -0.3}, {"E": 2e9, "force": 1.0}):
        assert same(loaded.model(values), rom.model(values))


def test_the_form_with_all_multipliers_is_left_out(tmp_path: Path) -> None:
    def eliminated(values: Mapping[str, float]) -> Case:
        material = sections.Material(values["E"], 1800.0)
        return Case(
            models.cantilever(3, section=models.SECTION, material=material), SCHEME, DURATION
        )

    model = affine.fit(eliminated, BOX[:1])
    assert model.nominal.system.full is not None
    loaded = parametric_model.load(
        parametric_model.save(ParametricModel(model), tmp_path / "full.rom")
    )
    assert loaded.model.nominal.system.full is None
    one, two = (
        parametric_model.run(loaded, E=7e8),
        parametric_model.run(ParametricModel(model), E=7e8),
    )
    assert np.array_equal(one.x, two.x)


def test_unknown_parameters_are_refused(saved: Path) -> None:
    loaded = parametric_model.load(saved)
    with pytest.raises(
        InputError, match=r"one of E, force, got 'forse'; did you mean 'force'\?"
    ) as caught:
        parametric_model.run(loaded, forse=1.0)
    assert caught.value.exit_code == 3
    with pytest.raises(
        InputError, match="parameter 'E': expected a positive number, as all of its range"
    ):
        parametric_model.run(loaded, E=-1)


def test_a_sign_that_no_value_of_the_range_has_is_refused(saved: Path) -> None:
    """Of a linear range, too."""
    loaded = parametric_model.load(saved)
    linear = tuple(replace(one, scale=Scale.LINEAR) for one in loaded.model.parameters)
    rom = replace(loaded, model=replace(loaded.model, parameters=linear))
    with pytest.raises(
        InputError,
        match=r"parameter 'E': expected a positive number, as all of its range, 5e\+08 to 2e\+09 Pa",
    ):
        parametric_model.case_of(rom, {"E": -1.0})
    parametric_model.case_of(rom, {"force": -0.5})


def test_a_notice_outside_of_the_training(saved: Path) -> None:
    loaded = parametric_model.load(saved)
    # log(5e8 / 4e8) / log(2e9 / 5e8) = 0.161
    far = r"runs outside its training: E = 4e\+08, trained from 5e\+08 to 2e\+09, 16% of that range outside; check its error"
    with pytest.warns(Notice, match=far):
        parametric_model.run(loaded, E=4e8)


def test_a_notice_of_a_longer_run_and_of_another_step(saved: Path) -> None:
    loaded, h = parametric_model.load(saved), SCHEME.step
    with pytest.warns(
        Notice, match="runs for 0.2 s, trained for 0.1 s; a step of 0.004 s, trained with 0.002 s"
    ):
        motion = parametric_model.run(loaded, 1, 0.2, 4e-3, E=1e9)
    assert (motion.times[-1], len(motion.times)) == (pytest.approx(0.2), 51)
    with warnings.catch_warnings():
        warnings.simplefilter("error", Notice)
        assert parametric_model.run(loaded, 1, 10 * h).times[-1] == pytest.approx(10 * h)
    with pytest.raises(InputError, match="a duration of 1 to 10000000 of them"):
        parametric_model.run(loaded, 1, 0.5 * h)


def test_any_damage_is_found(saved: Path) -> None:
    check_damage_is_found(saved, parametric_model.load)


@pytest.mark.parametrize(
    "old, new",
    [
        (b'"type": "Varying"', b'"type": "Popen00"'),
        (b'"mixture"', b'"mixtuna"'),
        (b'"gather", "section"', b'"gather", "sextion"'),
        (b'"low": 500000000.0', b'"low": 5000000000 '),
    ],
)
def test_content_that_does_not_fit_is_found(saved: Path, old: bytes, new: bytes) -> None:
    # changed on purpose, with a checksum that fits
    data = saved.read_bytes()
    assert old in data
    body = data[container.HEADER :].replace(old, new, 1)
    saved.write_bytes(container.header(body, parametric_model.KIND) + body)
    with pytest.raises(CorruptFile):
        parametric_model.load(saved)


def test_kinds_of_files_are_told_apart(rom: ParametricModel, saved: Path, tmp_path: Path) -> None:
    plain = files.save(rom.model.nominal.system, tmp_path / "plain.rom")
    with pytest.raises(
        CorruptFile,
        match="'fmbs_skfem parametric model' in its first line, got 'fmbs_skfem reduced model'",
    ):
        parametric_model.load(plain)
    with pytest.raises(
        CorruptFile,
        match="'fmbs_skfem reduced model' in its first line, got 'fmbs_skfem parametric model'",
    ):
        files.load(saved)
    saved.write_bytes(saved.read_bytes().replace(b"version 4\n", b"version 5\n", 1))
    with pytest.raises(CorruptFile, match="expected version 4 of the format, got version 5"):
        parametric_model.load(saved)
    with pytest.raises(InputError, match="a file of a reduced model, got no file"):
        parametric_model.load(tmp_path / "absent.rom")
    (tmp_path / "model.h5").touch()
    with pytest.raises(
        InputError, match=r"got a folder; give the file itself, such as .*model\.h5"
    ):
        parametric_model.load(tmp_path)


def test_python_functions_are_refused(rom: ParametricModel, tmp_path: Path) -> None:
    nominal = rom.model.nominal
    bad = replace(
        rom.model,
        nominal=replace(nominal, system=replace(nominal.system, signals=(np.sin,))),
        varying=(),
    )
    with pytest.raises(
        InputError,
        match=r"model\.nominal\.system\.signals\[0\].*a function of time that a file can hold",
    ):
        parametric_model.save(ParametricModel(bad), tmp_path / "bad.rom")
    assert not list(tmp_path.iterdir())


def test_hashes_of_files(tmp_path: Path) -> None:
    path = tmp_path / "beam.msh"
    path.write_bytes(b"mesh")
    assert parametric_model.hashes([path]) == {"beam.msh": hashlib.sha256(b"mesh").hexdigest()}
    with pytest.raises(InputError, match="a file that can be read"):
        parametric_model.hashes([tmp_path / "absent.msh"])


def test_summary(rom: ParametricModel) -> None:
    found = parametric_model.summary(rom)
    expected = {"low": 5e8, "high": 2e9, "nominal": 1e9, "unit": "Pa", "scale": "log", "degree": 1}
    assert found["parameters"]["E"] == expected
    assert found["parameters"]["force"]["degree"] == 1
    assert (found["steps"], found["unknowns"]) == (50, rom.model.nominal.system.size)
    assert found["outputs"] == ["tip"]
    assert found["notes"]["scene"] == "cantilever"
