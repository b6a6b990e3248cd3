"""Progress of long work below the cell of a notebook, and silence elsewhere."""

from __future__ import annotations

from typing import Any

import pytest

from fmbs_skfem import scenes
from fmbs_skfem.studies import notebooks

SCENE = """
schema: 1
dimension: 2
bodies: {block: {type: point_mass, mass: 1 kg, position: [0, 0]}}
loads: {push: {type: point_force, at: block, force: [1 N, 0]}}
analysis: {type: dynamic, duration: 2 s, step: 1 ms}
"""
CELL = f"""
from fmbs_skfem import scenes
from fmbs_skfem.studies import notebooks
notebooks.PATIENCE = notebooks.PACE = 0.0  # so that a short run is a long one
scenes.loads({SCENE!r}).run()
"""


def test_a_notebook_shows_one_line_that_changes_and_goes() -> None:
    """A notebook executed by its own kernel: what it is sent while the cell runs, and what it holds
    in the end.
    """
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    shown = list[tuple[str, str, str]]()

    class Watched(nbclient.NotebookClient):  # type: ignore[misc, name-defined]
        def process_message(self, message: Any, *more: Any) -> Any:
            content = message["content"]
            if message["msg_type"] in ("display_data", "update_display_data"):
                shown.append(
                    (
                        message["msg_type"],
                        content["transient"]["display_id"],
                        content["data"]["text/html"],
                    )
                )
            return super().process_message(message, *more)

    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CELL)])
    Watched(book, timeout=900, kernel_name="python3").execute()
    kinds, places, texts = zip(*shown, strict=True)
    assert kinds == ("display_data", *["update_display_data"] * (len(kinds) - 1))
    assert len(set(places)) == 1
    assert any("100% after" in text for text in texts)
    assert texts[-1] == ""
    displayed, result = [
        output for output in book.cells[0].outputs if output.output_type != "stream"
    ]
    assert displayed.data["text/html"] == ""
    assert "2001 instants" in result.data["text/plain"]


def test_scripts_are_not_told(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(notebooks, "PATIENCE", 0.0)
    monkeypatch.setattr(notebooks, "PACE", 0.0)
    scenes.loads(SCENE).run()
    assert capfd.readouterr() == ("", "")


def test_the_line_says_how_far_the_work_is_and_how_long_it_takes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now, texts = [0.0], list[str]()
    monkeypatch.setattr(notebooks.time, "perf_counter", lambda: now[0])
    line = notebooks.ProgressLine()
    monkeypatch.setattr(line, "show", texts.append)
    for moment, fraction in ((0.0, 0.0), (1.9, 0.1), (4.0, 0.2), (4.1, 0.21), (8.0, 0.5)):
        now[0] = moment
        line.progress("reduced <model>", fraction)
    assert [text.partition("> ")[2] for text in texts] == [
        "reduced &lt;model&gt;: 20% after 4 s, about 16 s left",
        "reduced &lt;model&gt;: 50% after 8 s, about 8 s left",
    ]
