"""`fmbs verify`: table, JSON, page and pictures; exit codes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from verification import CASES, CheckedNumber

from .calls import fmbs

NAMES = ("--case", "coefficients", "--case", "slider-crank", "--case", "beam-frequency-order")


def test_chosen_cases_are_solved_and_written(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = fmbs("verify", *NAMES, "--out", out, "--json")
    assert done.code == 0, done.err
    assert [found["case"] for found in done.json["cases"]] == [
        "beam-frequency-order",
        "slider-crank",
        "coefficients",
    ]
    assert done.json["failed"] == []
    stored = json.loads((out / "verification.json").read_text())
    assert [found["case"] for found in stored["cases"]] == [
        found["case"] for found in done.json["cases"]
    ]
    (position,) = [q for q in stored["cases"][1]["quantities"] if q["name"] == "position"]
    assert position["holds"]
    assert position["difference"] <= position["tolerance"]
    pictures = [out / f"verification_{group}.png" for group in ("vibration", "rigid", "integrator")]
    assert all(path.read_bytes()[:4] == b"\x89PNG" for path in pictures)
    page = (out / "verification.md").read_text()
    for text in (
        "### slider-crank",
        "Source: Arnold, Bruels",
        "| position |",
        "verification_vibration.png",
        "## What is outside",
    ):
        assert text in page


def test_results_of_other_cases_are_kept(tmp_path: Path) -> None:
    assert fmbs("verify", "--case", "coefficients", "--out", tmp_path).code == 0
    assert fmbs("verify", "--case", "coefficients", "--out", tmp_path).code == 0
    done = fmbs("verify", "--case", "slider-crank", "--out", tmp_path)
    assert done.code == 3
    assert "another run" in done.err
    assert fmbs("verify", "--case", "slider-crank", "--out", tmp_path, "--force").code == 0


def test_the_table_shows_every_quantity() -> None:
    done = fmbs("verify", "--case", "coefficients")
    assert done.code == 0
    assert "rho_inf = 0.95" in done.out
    assert "10 of 10 quantities are within their tolerance" in done.out


def test_the_list_solves_nothing() -> None:
    done = fmbs("verify", "--list", "--group", "integrator", "--json")
    assert done.code == 0
    assert {found["group"] for found in done.json["cases"]} == {"integrator"}
    assert "quantities" not in done.json["cases"][0]
    assert "golden-steps" in fmbs("verify", "--list").out


def test_a_quantity_that_is_off_is_exit_code_4(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    off = CheckedNumber("wrong", 1.0, 1.1, 1e-3, "m")
    monkeypatch.setitem(CASES, "coefficients", replace(CASES["coefficients"], solve=lambda: [off]))
    done = fmbs("verify", "--case", "coefficients", "--out", tmp_path, "--json")
    assert done.code == 4
    assert done.json["status"] == "error"
    assert done.json["failed"] == ["coefficients"]
    assert "off their references: coefficients" in done.err
    assert (
        "| wrong | 1 m | 1.1 m | 1.0e-01 | 1e-03 |  | off |"
        in (tmp_path / "verification.md").read_text()
    )


def test_an_unknown_case_or_group_is_bad_input() -> None:
    done = fmbs("verify", "--case", "slider-krank")
    assert done.code == 3
    assert "did you mean 'slider-crank'?" in done.err
    assert fmbs("verify", "--group", "optics").code == 3
