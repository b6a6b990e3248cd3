"""`fmbs view` opens its page where there are a terminal, a display and a browser; elsewhere it says
where the page lies.
"""

from __future__ import annotations

import os
import pty
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from ..cli.calls import fmbs
from ..studies.test_display_units import SCENE

Seen = Callable[..., tuple[str, str]]


@pytest.fixture
def view(tmp_path: Path) -> Seen:
    """A call of `fmbs view` on a terminal with a browser that notes what it shows: what was
    printed, and what was shown.
    """
    (tmp_path / "rotor.yaml").write_text(SCENE.format(more=""), encoding="utf-8")
    shown, browser = tmp_path / "shown.txt", tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > {shlex.quote(str(shown))}\n')
    browser.chmod(0o755)

    def call(*options: str, display: str = ":0") -> tuple[str, str]:
        shown.unlink(missing_ok=True)
        ours = {
            "BROWSER": str(browser),
            "DISPLAY": display,
            "WAYLAND_DISPLAY": "",
            "TERM": "xterm",
            "COLUMNS": "200",
        }
        command = [sys.executable, "-m", "fmbs_skfem", "view", "rotor.yaml", *options]
        here, there = pty.openpty()
        with subprocess.Popen(
            command,
            cwd=tmp_path,
            env={**os.environ, **ours},
            stdin=there,
            stdout=there,
            stderr=there,
        ) as one:
            os.close(there)
            text = b""
            try:
                while part := os.read(here, 4096):
                    text += part
            except OSError:  # the other end is closed
                os.close(here)
        assert one.returncode == 0, text
        return text.decode(), shown.read_text() if shown.exists() else ""

    return call


def test_the_page_opens_on_a_terminal_with_a_display(view: Seen, tmp_path: Path) -> None:
    printed, shown = view()
    assert shown == (tmp_path / "rotor.html").as_uri()
    assert "is open in your browser" in printed
    again, shown = view()  # a page of its own at the usual place is written anew
    assert shown
    assert "rotor.html" in again


def test_elsewhere_its_place_is_said(view: Seen, tmp_path: Path) -> None:
    for options, display in ((("--no-open",), ":0"), ((), ""), (("--html", "other.html"), ":0")):
        printed, shown = view(*options, display=display)
        assert not shown
        assert "opens in any browser" in printed
    done = fmbs("view", tmp_path / "rotor.yaml", "--html", tmp_path / "piped.html")  # no terminal
    assert "opens in any browser" in done.out


def test_a_file_of_somebody_else_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rotor.yaml").write_text(SCENE.format(more=""), encoding="utf-8")
    (tmp_path / "rotor.html").write_text("<!doctype html><p>my notes</p>", encoding="utf-8")
    done = fmbs("view", "rotor.yaml")
    assert done.code == 3
    assert "expected a new file" in done.err
    assert "my notes" in (tmp_path / "rotor.html").read_text(encoding="utf-8")
