"""Pictures: real pixels from the child process, frames of the GIF, and a clear error where OpenGL is missing."""

from __future__ import annotations

import ctypes.util
import itertools
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fmbs_skfem.core.errors import FmbsError, InputError, MissingFeature
from fmbs_skfem.results import frames, pictures, video
from fmbs_skfem.results.frames import Frames, line
from fmbs_skfem.results.pictures import Arrangement, Look
from fmbs_skfem.results.rendering import camera, decor, drawing, painter, render_child

from . import rollup

SIZE = (480, 360)


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A temporary folder of our own, to see what is left in it."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def saturated(image: np.ndarray) -> np.ndarray:
    """Where the picture is coloured, neither white, grey nor black."""
    return np.ptp(image, axis=2) > 60


@pytest.mark.usefixtures("opengl")
def test_the_beam_is_drawn_where_it_is(tmp_path: Path, temporary: Path) -> None:
    """Coloured pixels cover the projected half circle, and nothing but it, to the radius of the tube."""
    alone = replace(rollup.planar(), joints={})
    path = pictures.render(alone, tmp_path / "out" / "arc.png", times=[1.0], look=Look(size=SIZE), command=OWN)
    image = pixels(path)
    assert image.shape == (360, 480, 3)
    chosen = frames.select(alone, np.array([6]))
    job, arrays = pictures._order(chosen, Look(size=SIZE), "overlay", 1.0, "picture.png")
    view, _ = render_child.view(job, arrays, SIZE, render_child.letters(job))
    places = camera.project(view, chosen.bodies["beam"].points[0])
    drawn = saturated(image)
    assert all(drawn[round(y), round(x)] for x, y in places[2:-2])
    rows, columns = np.nonzero(drawn)
    np.testing.assert_allclose(
        [columns.min(), columns.max(), rows.min(), rows.max()], [*_range(places[:, 0]), *_range(places[:, 1])], atol=5
    )
    assert list(temporary.iterdir()) == []
    assert [file.name for file in path.parent.iterdir()] == ["arc.png"]


def _range(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())


@pytest.mark.usefixtures("opengl")
def test_curvature_gives_the_colours_of_the_scale(tmp_path: Path) -> None:
    """Small and large curvature in one picture: dark violet for the straight beam, yellow-green for the half circle."""
    look = Look(field="curvature", size=SIZE, limits=(0.0, np.pi))
    straight = pixels(pictures.render(rollup.planar(), tmp_path / "a.png", [0.0], look))[:, :340]
    rolled = pixels(pictures.render(rollup.planar(), tmp_path / "b.png", [1.0], look))[:, :340]
    violet, green = (image[saturated(image)].mean(axis=0) for image in (straight, rolled))
    assert violet[2] > violet[1] + 30
    assert green[1] > green[2] + 60


@pytest.mark.usefixtures("opengl")
def test_overlay_shows_several_instants_in_one_scene(tmp_path: Path) -> None:
    one = pixels(pictures.render(rollup.spatial(), tmp_path / "one.png", [1.0], Look(size=SIZE)))
    several = pixels(pictures.render(rollup.spatial(), tmp_path / "all.png", look=Look(size=SIZE, title="Roll-up")))
    assert several.shape == (360, 480, 3)
    assert saturated(several).sum() > 1.3 * saturated(one).sum()


@pytest.mark.usefixtures("opengl")
def test_multiples_show_one_instant_each(tmp_path: Path) -> None:
    """Six instants in two rows of three scenes beside the key; a beam in each, no two alike."""
    path = pictures.render(rollup.spatial(), tmp_path / "all.png", look=Look(size=(920, 640)), layout=Arrangement.MULTIPLES)
    image = pixels(path)
    assert (image.shape <= np.array([640, 920, 3])).all()
    width, height = (image.shape[1] - round(0.21 * 640) - 24) // 3, len(image) // 2
    cells = [image[row * height :][:height, column * width :][:, :width] for row in range(2) for column in range(3)]
    drawn = [saturated(cell) for cell in cells]
    assert min(cell.sum() for cell in drawn) > 100
    assert all((a != b).sum() > 50 for a, b in itertools.pairwise(drawn))


@pytest.mark.usefixtures("opengl")
def test_the_sheet_of_small_scenes_ends_where_they_end(tmp_path: Path) -> None:
    """A scene four times as wide as high fills its sheet: nothing below the numbers of the lowest axes."""
    times, x = np.linspace(0.0, 1.0, 6), np.linspace(0.0, 4.0, 9)
    points = np.stack([np.column_stack([x, 0.3 * t * np.sin(x), 0 * x]) for t in times])
    frames = Frames(times, {"wave": line(points, {}, 0.02, points[0])})
    image = pixels(pictures.render(frames, tmp_path / "a.png", look=Look(size=(1120, 800)), layout=Arrangement.MULTIPLES))
    ink = (image < 200).any(axis=(1, 2))
    assert len(image) < 800
    assert ink[-len(image) // 10 :].any()


def test_instants_of_equilibria_are_load_factors() -> None:
    times = np.array([0.0, 0.25, 0.5])
    job, _ = pictures._order(rollup.planar(), Look(clock="load factor"), "multiples", 1.0, "a.png")
    assert render_child.stamps(job, times)[1] == "load factor 0.25"
    assert render_child.marks(job, times)[1] == "load x 0.25"
    job, _ = pictures._order(rollup.planar(), Look(), "multiples", 1.0, "a.png")
    assert render_child.stamps(job, times)[1] == "t = 0.25 s"
    assert render_child.marks(job, times)[1] == "0.25 s"


def test_times_stand_at_an_end_that_moves() -> None:
    """The last body ends at a fixed hinge, where six times have no room beside each other."""
    turn = np.exp(0.25j * np.pi * np.arange(6))
    tip = np.column_stack([turn.real, turn.imag, 0 * turn.real])
    hinge = np.tile([3.0, 0.0, 0.0], (6, 1))
    arrays = {
        "points_0": np.stack([0 * tip, 0.5 * tip, tip], axis=1),
        "points_1": np.stack([tip, 0.5 * (tip + hinge), hinge], axis=1),
    }
    eye = camera.fit(np.array([[-1.0, -1.0, 0.0], [3.0, 1.0, 0.0]]), True, (800, 600), (50.0, 50.0, 50.0, 50.0))
    texts = render_child._marks(eye, arrays, 2, [f"{k} s" for k in range(6)], 15)
    places = np.array([text.place for text in texts])
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).min() > 45


def test_times_cover_no_body_and_no_joint() -> None:
    """Beyond the end of the first instant another body passes, at the second a joint stands: both times give way, the third not."""
    ends = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [4.0, 0.0, 0.0]])
    along, height = np.linspace(-0.5, 0.0, 21)[:, None], 15
    arrays = {
        "points_0": ends[:, None] + along * np.array([1.0, 0.0, 0.0]),
        "points_1": np.tile(np.array([0.2, 0.0, 0.0]) + (along + 0.25) * np.array([0.0, 2.0, 0.0]), (3, 1, 1)),
        "joint_0": np.tile([2.2, 0.0, 0.0], (3, 1)),
    }
    eye = camera.fit(np.array([[-1.0, -1.0, 0.0], [5.0, 1.0, 0.0]]), True, (1000, 600), (50.0, 50.0, 50.0, 50.0))
    texts = render_child._marks(eye, arrays, 1, ["0 s", "1 s", "2 s"], height)
    drawn = camera.project(eye, np.concatenate([points.reshape(-1, 3) for points in arrays.values()]))
    assert [render_child._covered(text, drawn, ()) for text in texts] == [0, 0, 0]
    places = np.array([text.place for text in texts[::-1]]) - camera.project(eye, ends)
    np.testing.assert_allclose(places[2], (2.4 * height, 0.0), atol=1e-9)
    assert (np.abs(places[:2, 1]) > height).all()


def test_times_stand_beside_masses_and_inside_of_the_picture() -> None:
    """A mass of 12 pixels hides no digit, and where the picture ends beyond it the time gives way."""
    along, height, radius = np.linspace(-0.5, 0.0, 21)[:, None], 15, 12.0
    tips = np.array([[2.0, 0.0, 0.0], [4.9, 0.0, 0.0]])
    arrays = {"points_0": tips[:, None] + along * np.array([1.0, 0.0, 0.0]), "joint_0": tips}
    eye = camera.fit(np.array([[-1.0, -1.0, 0.0], [5.0, 1.0, 0.0]]), True, (1000, 600), (0.0, 0.0, 50.0, 50.0))
    texts = render_child._marks(eye, arrays, 1, ["0.00 s", "1.00 s"], height, radius)[::-1]
    left, top, right, bottom = np.array([render_child.decor.extent(text) for text in texts]).T
    masses = camera.project(eye, tips)
    assert left[0] > masses[0, 0] + radius
    assert right.max() <= 1000
    assert not top[1] - radius < masses[1, 1] < bottom[1] + radius


def test_times_stand_at_the_middle_of_an_arch_that_is_held_at_both_ends() -> None:
    x = np.linspace(-1.0, 1.0, 21)
    arrays = {"points_0": np.stack([np.column_stack([x, height * (1 - x**2), 0 * x]) for height in (1.0, -1.0)])}
    eye = camera.fit(np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]]), True, (800, 600), (80.0, 80.0, 80.0, 80.0))
    texts = render_child._marks(eye, arrays, 1, ["load x 0", "load x 1"], 15)[::-1]
    crowns = camera.project(eye, np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]))
    assert np.linalg.norm(np.array([text.place for text in texts]) - crowns, axis=1).max() < 80


@pytest.mark.usefixtures("opengl")
def test_animation(tmp_path: Path) -> None:
    path = pictures.animate(rollup.spatial(), tmp_path / "a.gif", count=5, rate=10.0, look=Look(field="curvature", size=SIZE))
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.size, gif.info["duration"], gif.info["loop"]) == (5, SIZE, 100, 0)
        shots = []
        for number in range(gif.n_frames):
            gif.seek(number)
            shots.append(np.asarray(gif.convert("RGB")).astype(int))
    assert (shots[0][350, 5] == 255).all(), "the ground is not white"
    scene, key = np.s_[60:, :370], np.s_[:, 400:]
    for before, after in itertools.pairwise(shots):
        assert (np.abs(after[scene] - before[scene]).max(axis=2) > 60).sum() > 100, "the beam does not move"
        assert (after[:40, :370] != before[:40, :370]).any(), "the time does not change"
        np.testing.assert_array_equal(after[key], before[key])


STAND_IN = """\
#!{python}
import pathlib, sys
sent = sys.stdin.buffer.read()
pathlib.Path(sys.argv[-1]).write_bytes(b"film" + len(sent).to_bytes(4, "big"))
pathlib.Path(sys.argv[-1]).parents[0].joinpath("said").write_text(" ".join(sys.argv))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no scripts without a suffix")
def test_films_go_through_ffmpeg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for the program gets every pixel of every frame, with their size and rate; without it, what to install."""
    images = [np.full((6, 9, 3), shade, np.uint8) for shade in (0, 128, 255)]
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(video, "find_spec", lambda name: None)
    with pytest.raises(MissingFeature, match=r"ffmpeg.*none on the path.*apt-get install ffmpeg") as caught:
        pictures.animate(rollup.planar(), tmp_path / "a.mp4")
    assert caught.value.exit_code == 7
    (tmp_path / "ffmpeg").write_text(STAND_IN.format(python=sys.executable))
    (tmp_path / "ffmpeg").chmod(0o755)
    video.write(images, tmp_path / "a.mp4", 12.5)
    assert (tmp_path / "a.mp4").read_bytes() == b"film" + (3 * 6 * 9 * 3).to_bytes(4, "big")
    assert "-s 9x6 -r 12.5 -i -" in (tmp_path / "said").read_text()
    (tmp_path / "ffmpeg").write_text(f"#!{sys.executable}\nimport sys\nsys.exit('no such codec')\n")
    with pytest.raises(FmbsError, match="no such codec"):
        video.write(images, tmp_path / "b.mp4", 12.5)


OWN = (*painter.usual_command(), "own")  #: not that of the process at hand
KILLED = (sys.executable, "-c", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")


@pytest.mark.skipif(sys.platform == "win32", reason="no signals")
def test_a_killed_child_is_a_missing_feature(tmp_path: Path, temporary: Path) -> None:
    for draw in (
        lambda: pictures.probe(KILLED),
        lambda: pictures.render(rollup.planar(), tmp_path / "a.png", command=KILLED),
        lambda: pictures.animate(rollup.planar(), tmp_path / "a.gif", command=KILLED),
    ):
        with pytest.raises(MissingFeature, match=r"died with code -11.*libegl1.*libosmesa6.*DISPLAY") as caught:
            draw()
        assert caught.value.exit_code == 7
    assert list(temporary.iterdir()) == []
    assert [path.name for path in tmp_path.iterdir()] == ["temporary"]


@pytest.mark.skipif(sys.platform != "linux" or ctypes.util.find_library("OSMesa") is not None, reason="VTK falls back to OSMesa")
def test_vtk_without_any_opengl(monkeypatch: pytest.MonkeyPatch) -> None:
    """VTK told to use X where no X server runs: whatever it does then, this process lives and says what is missing."""
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkXOpenGLRenderWindow")
    monkeypatch.setenv("DISPLAY", "")
    with pytest.raises(MissingFeature, match="libegl1"):
        pictures.probe(OWN)


@pytest.mark.usefixtures("opengl")
def test_a_process_at_hand_draws_all_that_is_ordered_and_ends(
    tmp_path: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two pictures by one process; one that has died, as by the signal that stops a run, is replaced; in the end it is gone."""
    monkeypatch.setattr(painter, "_AT_HAND", [])
    with painter.at_hand():
        (one,) = painter._AT_HAND
        first = one.begin()
        for name in ("a.png", "b.png"):
            pictures.render(rollup.planar(), tmp_path / name, look=Look(size=SIZE))
            assert one.begin() is first
        np.testing.assert_array_equal(pixels(tmp_path / "a.png"), pixels(tmp_path / "b.png"))
        first.kill()
        first.wait()
        pictures.probe()
        last = one.begin()
        assert last is not first
    assert last.poll() is not None
    assert painter._AT_HAND == []
    assert list(temporary.iterdir()) == []


def test_other_failures_keep_their_words() -> None:
    with pytest.raises(MissingFeature, match="a program to draw with"):
        pictures.probe(("no-such-interpreter",))
    with pytest.raises(MissingFeature, match="no pyvista here"):
        pictures.probe((sys.executable, "-c", "import sys; sys.stderr.write('no pyvista here'); sys.exit(7)"))
    with pytest.raises(FmbsError, match="ValueError: bad picture") as caught:
        pictures.probe((sys.executable, "-c", "raise ValueError('bad picture')"))
    assert caught.value.exit_code == 1


def test_limits_of_the_scale() -> None:
    planar = rollup.planar()
    assert pictures.limits(planar, "curvature") == (0.0, np.pi)
    assert pictures.limits(planar, "strain") == (-0.5, 0.5)
    lines = planar.bodies["beam"]
    error = np.geomspace(1e-12, 1e-2, 41)[None] * np.ones((7, 1))
    both = replace(planar, bodies={"beam": replace(lines, fields={"strain": lines.points[:, :, 0] - 0.25, "error": error})})
    assert pictures.limits(both, "strain") == (-0.75, 0.75)
    assert pictures.limits(both, "error", logarithmic=True) == pytest.approx((1e-7, 1e-2))


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_round_off_of_straight_bodies_is_zero_and_says_so(size: float) -> None:
    """Curvatures are 1 / length, strains are none: the same beam in every unit; what is a million times as large is drawn."""
    planar = rollup.planar()
    beam = planar.bodies["beam"]
    noise = np.full(beam.points.shape[:2], 1e-16)
    lengths = {name: size * getattr(beam, name) for name in ("points", "reference", "size")}
    for factor, silent in ((1.0, True), (1e6, False)):
        still = replace(beam, **lengths, fields={"curvature": factor * noise / size, "strain": factor * noise})
        frames = replace(planar, bodies={"beam": still})
        for name, label in (("curvature", "curvature [1/m]"), ("strain", "axial strain [-]")):
            job, arrays = pictures._order(frames, Look(name), "overlay", 1.0, "a.png")
            assert job.look.label == label + (", round-off" if silent else "")
            assert arrays["values_0"].any() != silent
            assert not silent or job.limits == (0.0, 1.0)


def test_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'curvature'"):
        pictures.render(rollup.planar(), tmp_path / "a.png", look=Look(field="curvatur"))
    with pytest.raises(InputError, match=r"ending in \.png"):
        pictures.render(rollup.planar(), tmp_path / "a.bmp")
    with pytest.raises(InputError, match=r"ending in \.gif or \.mp4"):
        pictures.animate(rollup.planar(), tmp_path / "a.avi")
    with pytest.raises(InputError, match="frames a second"):
        pictures.animate(rollup.planar(), tmp_path / "a.gif", rate=1000.0)
    with pytest.raises(InputError, match="200 to 8000 pixels"):
        Look(size=(10, 10))
    with pytest.raises(InputError, match="logarithmic"):
        Look(logarithmic=True, limits=(0.0, 1.0))


def test_nothing_heavy_is_imported_before_it_is_used() -> None:
    heavy = {"pyvista", "vtk", "vtkmodules", "matplotlib", "meshio", "PIL"}
    code = f"import sys, fmbs_skfem.results; print(sorted({heavy} & {{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("planar, begin, end", [(True, -0.22, 0.0), (False, 0.0, 0.22)])
def test_arrows_of_forces_in_space_are_before_what_they_push(planar: bool, begin: float, end: float) -> None:
    """One that points to the eye begins at its place; all others end there."""
    order, _ = pictures._order(rollup.planar(), Look(), "overlay", 1.0, "a.png")
    places = {f"place_of_{j}": np.array([[1.0, 2.0, 0.0]]) for j in range(2)}
    arrays = places | {"aim_0": np.array([[0.0, 0.0, 5.0]]), "aim_1": np.array([[0.0, 0.0, -5.0]])}
    towards, away = drawing.shafts(replace(order, arrows=("force", "force"), planar=planar), arrays, 0.01)
    np.testing.assert_allclose(towards[0, [0, -1]], [[1.0, 2.0, begin], [1.0, 2.0, end]], atol=1e-15)
    np.testing.assert_allclose(away[0, [0, -1]], [[1.0, 2.0, 0.22], [1.0, 2.0, 0.0]], atol=1e-15)


@pytest.mark.parametrize("crowded, free", [((1, 1), (0, 1)), ((0, 1), (1, 1)), ((0, 0), (1, 1))])
@pytest.mark.parametrize("aim", [(0.0, -1.0, 0.0), (0.6, 0.8, 0.0)])
def test_gravity_stands_where_no_text_and_no_body_is(
    crowded: tuple[int, int], free: tuple[int, int], aim: tuple[float, float, float]
) -> None:
    """A time beside the end of a beam, or the beam itself, in the corner of the arrow drives it into the next one."""
    box = camera.box(np.array([[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]]), True, cells=4)
    eye = camera.fit(box.corners, True, (800, 600), (50.0, 50.0, 50.0, 50.0))
    order, _ = pictures._order(rollup.planar(), Look(), "overlay", 1.0, "a.png")
    job = replace(order, arrows=("gravity",), bodies=("beam",))
    middle = np.tile([1.0, 0.5, 0.0], (1, 2, 1))
    arrow = drawing.gravity_at(np.array(aim), box, crowded)
    place = camera.project(eye, arrow.mean(axis=0, keepdims=True))[0]
    label = decor.Text("0.25 s", (float(place[0]), float(place[1])), "mm", 15)
    arrays = {"aim_0": np.array([aim]), "points_0": middle}
    assert render_child._free_corner(job, arrays, eye, box, [label]) == free
    assert render_child._free_corner(job, arrays | {"points_0": arrow[None]}, eye, box, []) == free
    assert render_child._free_corner(job, arrays, eye, box, []) == (1, 1)
    ends = np.concatenate([drawing.gravity_at(np.array(aim), box, (a, b)) for a in (0, 1) for b in (0, 1)])
    assert (ends >= box.lower - 1e-12).all()
    assert (ends <= box.upper + 1e-12).all()
