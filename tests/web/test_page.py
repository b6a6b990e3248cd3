"""Pages in a real browser: nothing on the console, bodies where the numbers say, keys, names that
are no HTML, no WebGL.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmbs_skfem import studies
from fmbs_skfem.results.motion import frames
from fmbs_skfem.studies import reports
from fmbs_skfem.studies.running import viewing, webpages

from ..browser import DRAWS, FLAT, PROGRAM, Browser, browser
from ..cli.calls import EXAMPLES, fmbs
from ..studies.test_display_units import SCENE as ROTOR

pytestmark = pytest.mark.skipif(PROGRAM is None and "CI" not in os.environ, reason="no Chromium")

NASTY = '</script><b>"it\'s" <!-- &amp;'
SCENE = f"""\
schema: 1
name: {json.dumps(NASTY)}
dimension: 3
bodies:
  "I":
    type: cable
    mesh: {EXAMPLES.parent / "meshes" / "double_pendulum_100.msh"}
    line: I
    cells: 8
    section: {{shape: circular, diameter: 20 mm}}
    material: {{young_modulus: 50 MPa, density: 1800 kg/m^3}}
joints:
  A: {{type: spherical, at: I.A, to: ground}}
loads:
  weight: {{type: gravity, acceleration: [0, 0, -9.81 m/s^2]}}
  push: {{type: point_force, at: I.B, force: [0, 1 N, 0]}}
analysis: {{type: dynamic, duration: 0.5 s, step: 2 ms}}
outputs:
  tip: {{type: position, at: I.B}}
"""
READ = """(() => {
  const body = fmbs.content.films[0].bodies[0], places = fmbs.scene.read(0, 0);
  return { places, error: body.error, times: [...fmbs.content.films[0].times] };
})()"""
PIXELS = """(() => {
  fmbs.draw();
  const gl = fmbs.scene.gl, [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight], all = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, all);
  const words = new Uint32Array(all.buffer), counts = new Map();
  for (const word of words) counts.set(word, (counts.get(word) || 0) + 1);
  const sum = words.reduce((a, b) => (31 * a + b) | 0, 0);
  return { colours: counts.size, drawn: 1 - Math.max(...counts.values()) / words.length, sum };
})()"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[studies.Run, Path]:
    """A falling rod with names that are no HTML, and its page."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "rod.yaml").write_text(SCENE, encoding="utf-8")
    found = studies.run(
        folder / "rod.yaml", html=True, out=folder / "out", plots=False, allow_outside=True
    )
    return found, folder / "out" / "page.html"


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("profile"), DRAWS) as one:
        yield one


def opened(tab: Browser, page: Path, width: int = 1280, height: int = 900) -> Browser:
    """The page, when it is drawn."""
    tab.wrong.clear()
    tab.resize(width, height)
    tab.load(page)
    wait(tab, "document.body.dataset.ready === 'true'")
    return tab


def wait(tab: Browser, what: str, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not tab.run(what):
        assert time.monotonic() < end, (what, tab.wrong)
        time.sleep(0.02)


def test_the_page_is_one_file_of_the_run(run: tuple[studies.Run, Path]) -> None:
    found, page = run
    assert page in found.files
    text = page.read_text(encoding="utf-8")
    assert "http" not in text.replace("http-equiv", "").replace("http://www.w3.org/2000/svg", "")
    assert text.count("</script>") == 3
    assert "<!--" not in text
    assert NASTY not in text


def test_the_browser_has_nothing_to_complain_of_and_draws(
    run: tuple[studies.Run, Path], chromium: Browser
) -> None:
    tab = opened(chromium, run[1])
    found = tab.run(PIXELS)
    assert found["colours"] > 50
    assert 0.005 < found["drawn"] < 0.5
    later = tab.run(f"(fmbs.seek(0.4), {PIXELS})")
    assert later["sum"] != found["sum"]
    assert tab.wrong == []


def test_names_are_texts(run: tuple[studies.Run, Path], chromium: Browser) -> None:
    tab = opened(chromium, run[1])
    assert tab.run("document.title") == NASTY
    assert tab.run("document.querySelector('h1').textContent") == NASTY
    assert tab.run("document.querySelectorAll('b').length") == tab.run(
        "document.querySelectorAll('figcaption b').length"
    )


def test_the_card_puts_the_tip_where_the_outputs_say(
    run: tuple[studies.Run, Path], chromium: Browser
) -> None:
    """At every instant of the page, to the error that it states, which is below a tenth of a pixel,
    and single precision.
    """
    found, page = run
    tab = opened(chromium, page)
    tip = np.column_stack([found.outputs[f"tip_{axis}"] for axis in "xyz"])
    for number in (0, 40, 125, 250):
        read: Any = tab.run(
            f"(fmbs.seek(fmbs.content.films[0].times[{number}]), fmbs.draw(), {READ})"
        )
        assert read["times"][number] == pytest.approx(found.times[number], abs=1e-7)
        assert (
            np.linalg.norm(np.array(read["places"][-1][:3]) - tip[number]) <= read["error"] + 2e-6
        )
        assert read["error"] <= 2e-4


def test_between_two_instants_the_rod_keeps_its_length(
    run: tuple[studies.Run, Path], chromium: Browser
) -> None:
    tab = opened(chromium, run[1])
    read: Any = tab.run(f"(fmbs.seek(0.4013), fmbs.draw(), {READ})")
    points = np.array(read["places"])[:, :3]
    exact = np.column_stack(
        [np.interp(0.4013, run[0].times, run[0].outputs[f"tip_{axis}"]) for axis in "xyz"]
    )[0]
    assert np.linalg.norm(points[-1] - exact) <= 1e-3
    assert float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) == pytest.approx(
        1.0, rel=2e-2
    )


def test_keys_play_and_go_through_the_instants(
    run: tuple[studies.Run, Path], chromium: Browser
) -> None:
    tab = opened(chromium, run[1])
    tab.press("End")
    assert tab.run("fmbs.state.time") == pytest.approx(0.5)
    tab.press("ArrowLeft")
    assert tab.run("fmbs.state.time") == pytest.approx(0.498)
    tab.press("Home")
    tab.press("ArrowRight", modifiers=8)
    assert tab.run("fmbs.state.time") == pytest.approx(0.02)
    before = tab.run("fmbs.state.frames")
    tab.press(" ")
    wait(tab, f"fmbs.state.frames > {before} + 5 && fmbs.state.time !== 0.02")
    tab.press(" ")
    assert tab.run("fmbs.state.playing") is False
    view = tab.run("fmbs.scene.eye.axes()")
    tab.press("z")
    assert tab.run("fmbs.scene.eye.axes()") != view
    assert np.allclose(tab.run("fmbs.scene.eye.axes()[2]"), [0.0, 0.0, 1.0], atol=1e-12)
    assert tab.wrong == []


def test_dragging_turns_and_wheels_zoom(run: tuple[studies.Run, Path], chromium: Browser) -> None:
    tab = opened(chromium, run[1])
    around, zoom = tab.run("fmbs.scene.eye.around"), tab.run("fmbs.scene.eye.zoom")
    for kind, x, held in (
        ("mousePressed", 300, 1),
        ("mouseMoved", 350, 1),
        ("mouseReleased", 350, 0),
    ):
        tab.ask(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x,
            y=400,
            button="left",
            buttons=held,
            clickCount=1,
        )
    assert tab.run("fmbs.scene.eye.around") == pytest.approx(around - 0.4)
    tab.ask("Input.dispatchMouseEvent", type="mouseWheel", x=300, y=400, deltaX=0, deltaY=-200)
    wait(tab, f"fmbs.scene.eye.zoom > {zoom}")


def test_pointing_at_a_plot_seeks(run: tuple[studies.Run, Path], chromium: Browser) -> None:
    tab = opened(chromium, run[1])
    box: Any = tab.run(
        "(({x, y, width, height}) => ({x, y, width, height}))(document.querySelector('#plots svg').getBoundingClientRect())"
    )
    for kind, held in (("mousePressed", 1), ("mouseReleased", 0)):
        place = {"x": box["x"] + 52 + (box["width"] - 60) / 2, "y": box["y"] + box["height"] / 2}
        tab.ask(
            "Input.dispatchMouseEvent",
            type=kind,
            button="left",
            buttons=held,
            clickCount=1,
            **place,
        )
    assert tab.run("fmbs.state.time") == pytest.approx(0.25, abs=2e-3)


def test_a_picture_is_saved_with_its_scale(
    run: tuple[studies.Run, Path], chromium: Browser
) -> None:
    tab = opened(chromium, run[1])
    assert tab.run("fmbs.picture().toDataURL('image/png').length") > 5000
    assert tab.wrong == []


@pytest.mark.parametrize("width", [390, 800, 1280])
def test_pages_fit_phones_and_screens(
    run: tuple[studies.Run, Path], chromium: Browser, width: int
) -> None:
    tab = opened(chromium, run[1], width, 800)
    assert tab.run("document.documentElement.scrollWidth") <= width
    assert tab.run("fmbs.scene.canvas.clientWidth") >= 0.5 * min(width, 700)
    assert tab.wrong == []


def test_frames_of_a_window_of_800_by_600(chromium: Browser, run: tuple[studies.Run, Path]) -> None:
    """Drawn in software and read back one by one; 30 a second are wanted, a busy machine may give a
    third of that.
    """
    tab = opened(chromium, run[1], 1310, 860)
    timed = """(() => {
      const { scene, look } = fmbs, one = new Uint8Array(4), begin = performance.now();
      for (let i = 0; i < 30; i++) { scene.draw(i / 60, look); scene.gl.readPixels(0, 0, 1, 1, 6408, 5121, one); }
      return 30000 / (performance.now() - begin);
    })()"""
    assert tab.run(
        "[fmbs.scene.canvas.width, fmbs.scene.canvas.height].every((n, k) => n > [780, 570][k])"
    )
    assert max(tab.run(timed) for _ in range(3)) > 10.0


def test_without_webgl_the_page_says_so_and_shows_the_plots(
    run: tuple[studies.Run, Path], tmp_path: Path
) -> None:
    with browser(tmp_path, (*FLAT, "--disable-3d-apis")) as tab:
        opened(tab, run[1])
        assert "WebGL2" in tab.run("document.getElementById('unable').textContent")
        assert tab.run("document.querySelectorAll('#plots polyline').length") == 3
        tab.press("End")
        assert tab.run("fmbs.state.time") == pytest.approx(0.5)


def test_a_folder_of_results_is_shown_and_kept(
    run: tuple[studies.Run, Path], tmp_path: Path
) -> None:
    folder = run[1].parent
    target = tmp_path / "again.html"
    done = fmbs("view", folder, "--html", target, "--allow-outside", "--json")
    assert done.code == 0, done.err
    assert done.json["files"] == [str(target)]
    assert done.json["bytes"] == target.stat().st_size < 500_000
    again = fmbs("view", folder, "--html", target, "--allow-outside")
    assert again.code == 3
    assert "expected a new file" in again.err


def test_states_that_a_folder_has_are_shown_and_not_run_again(
    run: tuple[studies.Run, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a run with checkpoints; its page is that of the motion itself."""
    out = tmp_path / "out"
    studies.run(
        run[1].parents[1] / "rod.yaml", checkpoint=0.0, out=out, plots=False, allow_outside=True
    )
    monkeypatch.setattr(viewing, "attempt", lambda *_: pytest.fail("it ran again"))
    done = fmbs("view", out)
    assert done.code == 0, done.err
    assert (out / "page.html").read_bytes() == run[1].read_bytes()


def test_a_folder_of_another_scene_is_refused(
    run: tuple[studies.Run, Path], tmp_path: Path
) -> None:
    folder = tmp_path / "changed"
    folder.mkdir()
    report = json.loads((run[1].parent / "report.json").read_text(encoding="utf-8"))
    report = {
        key: value for key, value in report.items() if key not in (reports.CHECKSUMS, "files")
    }
    reports.write_report(folder, {**report, "fingerprint": "0"})
    done = fmbs("view", folder, "--html", tmp_path / "page.html", "--allow-outside")
    assert done.code == 3
    assert "as it was run" in done.err
    (folder / "report.json").unlink()
    assert "a folder of fmbs run" in fmbs("view", folder).err


def test_a_model_in_the_page_moves_bodies_and_joints_by_its_unknowns(
    chromium: Browser, tmp_path: Path
) -> None:
    """A model of recorded states, whose slider asks for one of them: the points are those of the
    recorded motion.
    """
    more = "events: {end: {when: t - 0.3517 s, stop: true}}\nreduction: {snapshots: 10 ms}\n"
    (tmp_path / "rod.yaml").write_text(SCENE + more, encoding="utf-8")
    studies.reduce(tmp_path / "rod.yaml", out=tmp_path / "rod.h5", allow_outside=True)
    motion = studies.run_model(tmp_path / "rod.h5", html=True, out=tmp_path / "out", plots=False)
    tab = opened(chromium, tmp_path / "out" / "page.html")
    states = motion.trajectory.x[:: len(motion.times) // 10]
    at = motion.times[:: len(motion.times) // 10]
    tab.run(f"""fmbs.attach({{
      states: {json.dumps(states.tolist())}, stepSize: 0.002, which: 0,
      inputs: [{{ name: "which", unit: "", low: 0, high: 9, value: 3 }}],
      set(parameters, inputs) {{ this.which = Math.round(inputs.which); }},
      reset() {{}},
      step(n) {{ return this.states[this.which]; }},
    }})""")
    assert not tab.run("document.getElementById('sliders').hidden")
    for number in (3, 7):
        move = f"bar.value = {number}; bar.dispatchEvent(new Event('input')); fmbs.state.live.advance(0.002); fmbs.draw();"
        tab.run(f"((bar) => {{ {move} }})(document.querySelector('#sliders input'))")
        live = np.array(tab.run("fmbs.scene.read(0, 0)"))[:, :3]
        tip = np.array(
            [np.interp(at[number], motion.times, motion.outputs[f"tip_{axis}"]) for axis in "xyz"]
        )
        assert np.linalg.norm(live[-1] - tip) <= 1e-4
    tab.run("fmbs.detach()")
    recorded = np.array(
        tab.run(f"(fmbs.seek({float(at[7])}), fmbs.draw(), fmbs.scene.read(0, 0))")
    )[:, :3]
    assert np.abs(recorded - live).max() <= 2e-5
    assert tab.run("document.getElementById('sliders').hidden")
    assert tab.wrong == []


def test_numbers_have_the_units_that_were_typed(chromium: Browser, tmp_path: Path) -> None:
    """300 rpm, 25 mm and 40 ms, as the scene has them; the motion itself goes on in SI units."""
    (tmp_path / "rotor.yaml").write_text(ROTOR.format(more=""), encoding="utf-8")
    found = studies.run(tmp_path / "rotor.yaml", html=True, out=tmp_path / "out", plots=False)
    tab = opened(chromium, tmp_path / "out" / "page.html")
    captions = tab.run(
        "[...document.querySelectorAll('figcaption b')].map((one) => one.textContent)"
    )
    assert captions == ["w [rpm]", "angle [rad]", "rim [mm]", "drive [W]"]
    tab.run("(fmbs.seek(0.02), fmbs.draw())")
    assert tab.run("document.getElementById('time').textContent") == "t = 20.00 ms"
    shown = float(tab.run("document.querySelector('figcaption span span').textContent"))
    assert shown == pytest.approx(found.outputs["w"][20] * 30.0 / np.pi, rel=2e-4)
    marks = tab.run(
        "[...document.querySelectorAll('figure')[0].querySelectorAll('text[text-anchor=middle]')].map((one) => one.textContent)"
    )
    assert "20 ms" in marks
    assert "grid 5 mm" in tab.run("document.getElementById('key').textContent")
    assert tab.run("fmbs.last") == pytest.approx(0.04)
    place = np.array(tab.run("fmbs.scene.read(0, 0)"))[:, :2]
    assert np.abs(np.linalg.norm(place, axis=1) - 0.025).min() < 1e-6
    assert tab.wrong == []


def test_two_motions_are_overlaid_or_side_by_side(
    run: tuple[studies.Run, Path], chromium: Browser, tmp_path: Path
) -> None:
    """The same motion and a heavier rod, with the distance of the two as a colour."""
    (tmp_path / "heavy.yaml").write_text(SCENE.replace("1800 kg", "3600 kg"), encoding="utf-8")
    heavy = studies.run(tmp_path / "heavy.yaml", allow_outside=True).trajectory
    films = [
        webpages.film_of("</script>", run[0].trajectory),
        webpages.film_of("heavy", heavy, full=run[0].trajectory),
    ]
    tab = opened(chromium, webpages.write(tmp_path / "two.html", "two", films, "curvature", "s"))
    over = tab.run(f"(fmbs.seek(0.45), {PIXELS})")
    tab.run(
        "((one) => { one.value = 'side'; one.dispatchEvent(new Event('change')); })(document.getElementById('layout'))"
    )
    side = tab.run(f"(fmbs.setShade('error'), {PIXELS})")
    assert side["sum"] != over["sum"]
    assert tab.run(
        "[...document.querySelectorAll('#panes span')].map((one) => one.textContent)"
    ) == ["</script>", "heavy"]
    scale, size = tab.run(
        "((one) => [one.limits, one.size])(fmbs.content.shades.find((one) => one.name === 'error'))"
    )
    shown, others = (np.array(tab.run(f"fmbs.scene.read({k}, 0)")) for k in (0, 1))
    apart = np.linalg.norm(shown[:, :3] - others[:, :3], axis=1)
    assert np.abs(others[:, 3] - apart / size).max() <= (scale[1] - scale[0]) / 250 + 4e-4 / size
    assert apart.max() > 0.01
    assert tab.run("document.querySelectorAll('#plots polyline').length") == 6
    assert tab.wrong == []


def test_a_saved_model_runs_in_its_page_as_in_python(chromium: Browser, tmp_path: Path) -> None:
    """Its tip is that of the run, to the error of the shapes; started again it goes the same way,
    to the bit.
    """
    more = "events: {end: {when: t - 0.3517 s, stop: true}}\nreduction: {snapshots: 10 ms}\n"
    (tmp_path / "rod.yaml").write_text(SCENE + more, encoding="utf-8")
    studies.reduce(tmp_path / "rod.yaml", out=tmp_path / "rod.h5", allow_outside=True)
    motion = studies.run_model(tmp_path / "rod.h5")
    done = fmbs("view", tmp_path / "rod.h5", "--html", tmp_path / "rod.html")
    assert done.code == 0, done.err
    tab = opened(chromium, tmp_path / "rod.html")
    tab.run(
        "loadModel(fmbs.content.live).then((model) => { fmbs.attach(model); fmbs.state.model = model; })"
    )
    go_on = "while (live.time < 0.299) live.advance(Math.min(0.02, 0.3 - live.time));"  # a busy browser takes fewer steps at once
    tab.run(f"(({{ live }}) => {{ {go_on} fmbs.draw(); }})(fmbs.state)")
    at = tab.run("fmbs.state.live.time")
    tip = np.array([np.interp(at, motion.times, motion.outputs[f"tip_{axis}"]) for axis in "xyz"])
    assert np.linalg.norm(np.array(tab.run("fmbs.scene.read(0, 0)"))[-1, :3] - tip) <= 1e-4
    shades_and_loads(tab, motion, at)
    outputs_over_time(tab, motion)
    first = tab.run("[...fmbs.state.model.step(0)]")
    tab.run(f"(({{ live }}) => {{ live.reset(); {go_on} }})(fmbs.state)")
    assert tab.run("fmbs.state.live.time") == at
    assert tab.run("[...fmbs.state.model.step(0)]") == first
    told = "fmbs.state.live.stopped.hidden ? '' : fmbs.state.live.stopped.textContent"
    assert tab.run(told) == ""
    tab.run("((live) => { while (!live.model.status) live.advance(0.02); })(fmbs.state.live)")
    assert tab.run(told) == "An event stops the motion at t = 0.3517 s."
    tab.run("fmbs.state.live.reset()")
    assert tab.run(told) == ""
    # as the step of the model has it
    tab.run("(fmbs.state.model.status = 3, fmbs.state.live.advance(0.01))")
    assert "stands still" in tab.run(told)
    tab.run("fmbs.state.live.reset()")
    assert tab.run(told) == ""
    beyond_ranges(tab, told)
    assert tab.wrong == []


def beyond_ranges(tab: Browser, told: str) -> None:
    """An input that no training knows is named, once, and no longer when it is back; where a model
    does not start, that is said.
    """
    own = "inputs: {value: [{name: 'push', unit: 'kN', size: 1e3, low: -1e3, high: 1e3, value: 2e3}]}, set: {value() {}}"
    tab.run(f"fmbs.attach(Object.create(fmbs.state.model, {{ {own} }}))")
    shown = "[...document.querySelectorAll('#sliders p[role=status]:not([hidden])')].map((one) => one.textContent)"
    assert tab.run(shown) == ["No error is known: push = 2 (trained from -1 to 1 kN)."]
    tab.run("((live) => { live.model.status = 2; live.tellStopped(); })(fmbs.state.live)")
    assert "It does not start there" in tab.run(told)
    tab.run(
        "((bar) => { bar.value = 500; bar.dispatchEvent(new Event('input')); })(document.querySelector('#sliders input'))"
    )
    assert tab.run(shown) == []


def shades_and_loads(tab: Browser, motion: studies.Run, at: float) -> None:
    """The rod is coloured by the curvature and strain of its run at this time, to half floats, and
    the force acts at its tip.
    """
    row = int(np.abs(motion.times - at).argmin())
    assert motion.times[row] == pytest.approx(at, abs=1e-9)
    body = next(iter(frames(motion.trajectory, np.array([row])).bodies.values()))
    for shade in ("curvature", "strain"):
        shown = np.array(
            tab.run(f"(fmbs.setShade('{shade}'), fmbs.draw(), fmbs.scene.read(0, 0))")
        )[:, 3]
        wanted = body.fields[shade][0] / tab.run(
            f"fmbs.content.shades.find((one) => one.name === '{shade}').size"
        )
        assert np.abs(shown - wanted).max() <= 1e-3 * np.abs(wanted).max() + 1e-6
        assert "recorded" not in tab.run("document.getElementById('key').textContent")
    # which no page can tell of a model that runs
    tab.run("(fmbs.setShade('axial_force'), fmbs.draw())")
    assert "recorded run alone" in tab.run("document.getElementById('key').textContent")
    force = tab.run(
        "(({ still, places }) => [still, [...places.live]])(fmbs.scene.films[0].marks.find((one) => one.kind === 'force'))"
    )
    assert not force[0]
    assert (
        np.abs(np.array(force[1]) + tab.run("fmbs.content.middle") - body.points[0, -1]).max()
        <= 1e-4
    )


def outputs_over_time(tab: Browser, motion: studies.Run) -> None:
    """Outputs of the model are drawn as it runs, those of the run to what the tolerance of Newton's
    iteration leaves.
    """
    curves: Any = tab.run(
        "fmbs.plots.curves.map(({ column, live, band, size }) => ({ column, times: live.times, values: live.values, band, size }))"
    )
    assert [curve["column"] for curve in curves] == ["tip_x", "tip_y", "tip_z"]
    for curve in curves:
        wanted = np.interp(curve["times"], motion.times, motion.outputs[curve["column"]])
        assert len(wanted) > 10
        assert np.abs(curve["size"] * np.array(curve["values"]) - wanted).max() <= 1e-8
        assert 0.0 < curve["size"] * curve["band"] < 0.1
    assert tab.run("document.querySelectorAll('#plots polyline.live').length") == 3


def test_the_outputs_of_a_model_that_runs_on_stay_in_view(
    chromium: Browser, tmp_path: Path
) -> None:
    (tmp_path / "rod.yaml").write_text(SCENE + "reduction: {snapshots: 10 ms}\n", encoding="utf-8")
    studies.reduce(tmp_path / "rod.yaml", out=tmp_path / "rod.h5", allow_outside=True)
    studies.run_model(tmp_path / "rod.h5", html=True, out=tmp_path / "out", plots=False)
    tab = opened(chromium, tmp_path / "out" / "page.html")
    unknowns = tab.run("fmbs.content.films[0].live.bodies[0].shape[1] - 1")
    tab.run(f"""fmbs.attach({{
      columns: ["tip_x"], stepSize: 0.002, count: 0, set() {{}}, reset() {{ this.count = 0; }},
      step(n) {{ this.count += n; return new Float64Array({unknowns}); }},
      outputs() {{ return [this.count]; }},
    }})""")
    tab.run(
        "(() => { for (let k = 0; k < 400; k++) fmbs.state.live.advance(0.002); fmbs.plots.draw(); fmbs.draw(); })()"
    )
    first, last = tab.run("(({ first, last }) => [first, last])(fmbs.plots.figures[0].panel)")
    assert (first, last) == pytest.approx((0.3, 0.8), abs=1e-6)
    times, values = tab.run("(({ live }) => [live.times, live.values])(fmbs.plots.curves[0])")
    assert times[0] >= 0.3 - 1e-9
    size = tab.run("fmbs.plots.curves[0].size")
    assert size * np.array(values) == pytest.approx(np.array(times) / 0.002)
    assert float(tab.run("fmbs.plots.curves[0].shown.textContent").split()[-1]) == pytest.approx(
        400.0 / size
    )
    tab.run("fmbs.detach()")
    assert tab.run("fmbs.plots.figures[0].panel.last") == pytest.approx(0.5)
    assert tab.run("document.querySelectorAll('#plots polyline.live').length") == 0
    assert tab.wrong == []
