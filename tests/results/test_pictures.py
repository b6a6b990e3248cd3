"""Pictures: real pixels from the child process, frames of the GIF, and a clear error where OpenGL
is missing.
"""

from __future__ import annotations

import ctypes.util
import itertools
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fmbs_skfem.core.errors import FmbsError, InputError, MissingFeature
from fmbs_skfem.core.values.display import DisplayUnits
from fmbs_skfem.results import colour_scales, frames, pictures, video
from fmbs_skfem.results.frames import Frames, line
from fmbs_skfem.results.pictures import Arrangement, PictureOptions
from fmbs_skfem.results.rendering import camera, decor, drawing, painter, render_child
from fmbs_skfem.results.rendering.job import PictureJob

from . import rollup

SIZE = (480, 360)


def order(shown: Frames, options: PictureOptions | None = None) -> PictureJob:
    return pictures.make_job(shown, options or PictureOptions(), "overlay", 1.0, Path("a.png.part"))


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def saturated(image: np.ndarray) -> np.ndarray:
    """Where the picture is coloured, neither white, grey nor black."""
    return np.ptp(image, axis=2) > 60


@pytest.mark.usefixtures("opengl")
def test_the_beam_is_drawn_where_it_is(tmp_path: Path) -> None:
    """Coloured pixels cover the projected half circle, and nothing but it, to the radius of the
    tube.
    """
    alone = replace(rollup.planar(), marks={})
    path = pictures.render(
        alone, tmp_path / "out" / "arc.png", times=[1.0], options=PictureOptions(size=SIZE)
    )
    image = pixels(path)
    assert image.shape == (360, 480, 3)
    chosen = frames.select(alone, np.array([6]))
    job = order(chosen, PictureOptions(size=SIZE))
    view = render_child.view(job, (SIZE[0] - decor.width(job), SIZE[1]), render_child.letters(job))
    places = camera.project(view, chosen.bodies["beam"].points[0])
    drawn = saturated(image[:, : view.size[0]])
    assert all(drawn[round(y), round(x)] for x, y in places[2:-2])
    rows, columns = np.nonzero(drawn)
    np.testing.assert_allclose(
        [columns.min(), columns.max(), rows.min(), rows.max()],
        [*_range(places[:, 0]), *_range(places[:, 1])],
        atol=5,
    )
    assert [file.name for file in path.parent.iterdir()] == ["arc.png"]


def _range(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())


@pytest.mark.usefixtures("opengl")
def test_curvature_gives_the_colours_of_the_scale(tmp_path: Path) -> None:
    """Small and large curvature in one picture: dark violet for the straight beam, yellow-green for
    the half circle.
    """
    options = PictureOptions(field="curvature", size=SIZE, limits=(0.0, np.pi))
    straight = pixels(pictures.render(rollup.planar(), tmp_path / "a.png", [0.0], options))[:, :340]
    rolled = pixels(pictures.render(rollup.planar(), tmp_path / "b.png", [1.0], options))[:, :340]
    violet, green = (image[saturated(image)].mean(axis=0) for image in (straight, rolled))
    assert violet[2] > violet[1] + 30
    assert green[1] > green[2] + 60


@pytest.mark.usefixtures("opengl")
def test_overlay_shows_several_instants_in_one_scene(tmp_path: Path) -> None:
    one = pixels(
        pictures.render(rollup.spatial(), tmp_path / "one.png", [1.0], PictureOptions(size=SIZE))
    )
    several = pixels(
        pictures.render(
            rollup.spatial(),
            tmp_path / "all.png",
            options=PictureOptions(size=SIZE, title="Roll-up"),
        )
    )
    assert several.shape == (360, 480, 3)
    assert saturated(several).sum() > 1.3 * saturated(one).sum()


@pytest.mark.usefixtures("opengl")
def test_an_overlay_of_many_instants_in_the_plane_shows_the_last_one(tmp_path: Path) -> None:
    """Thirty instants of a bar that rises stand one before the other; the last one has the full
    colour.
    """
    points = np.stack(
        [
            np.column_stack([np.linspace(0.0, 1.0, 5), np.full(5, height), np.zeros(5)])
            for height in np.linspace(0, 0.2, 30)
        ]
    )
    rising = lines(points)
    options = PictureOptions(size=SIZE)
    image = pixels(pictures.render(rising, tmp_path / "a.png", rising.times.tolist(), options))
    job = order(rising, options)
    view = render_child.view(job, (SIZE[0] - decor.width(job), SIZE[1]), render_child.letters(job))
    x, y = camera.project(view, points[-1, 2]).round().astype(int)
    assert np.abs(image[y - 2 : y + 3, x].min(axis=0) - (0, 114, 178)).max() < 60


@pytest.mark.usefixtures("opengl")
def test_the_arrow_of_a_load_is_there_while_it_acts(tmp_path: Path) -> None:
    """In the first of three small scenes; nothing of it stays in the others."""
    planar = frames.select(rollup.planar(), np.array([0, 3, 6]))
    push = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    loaded = replace(
        planar, marks={"push": frames.Mark("force", planar.bodies["beam"].points[:, -1], push)}
    )
    options = PictureOptions(size=(900, 400))
    image = pixels(
        pictures.render(loaded, tmp_path / "a.png", None, options, Arrangement.MULTIPLES)
    )
    columns, view = render_child.arrange(order(loaded, options))
    red = np.abs(image - (176, 0, 88)).max(axis=2) < 40
    width, height = view.size
    cells = [
        red[k // columns * height :][:height, k % columns * width :][:, :width].sum()
        for k in range(3)
    ]
    assert cells[0] > 50
    assert cells[1:] == [0, 0]


@pytest.mark.usefixtures("opengl")
def test_multiples_show_one_instant_each(tmp_path: Path) -> None:
    """Six instants in two rows of three scenes beside the key; a beam in each, no two alike."""
    path = pictures.render(
        rollup.spatial(),
        tmp_path / "all.png",
        options=PictureOptions(size=(920, 640)),
        layout=Arrangement.MULTIPLES,
    )
    image = pixels(path)
    assert (image.shape <= np.array([640, 920, 3])).all()
    width, height = (image.shape[1] - round(0.21 * 640) - 24) // 3, len(image) // 2
    cells = [
        image[row * height :][:height, column * width :][:, :width]
        for row in range(2)
        for column in range(3)
    ]
    drawn = [saturated(cell) for cell in cells]
    assert min(cell.sum() for cell in drawn) > 100
    assert all((a != b).sum() > 50 for a, b in itertools.pairwise(drawn))


@pytest.mark.usefixtures("opengl")
def test_the_sheet_of_small_scenes_ends_where_they_end(tmp_path: Path) -> None:
    """A scene four times as wide as high fills its sheet: nothing below the numbers of the lowest
    axes.
    """
    times, x = np.linspace(0.0, 1.0, 6), np.linspace(0.0, 4.0, 9)
    points = np.stack([np.column_stack([x, 0.3 * t * np.sin(x), 0 * x]) for t in times])
    frames = Frames(times, {"wave": line(points, {}, 0.02, points[0])})
    image = pixels(
        pictures.render(
            frames,
            tmp_path / "a.png",
            options=PictureOptions(size=(1120, 800)),
            layout=Arrangement.MULTIPLES,
        )
    )
    ink = (image < 200).any(axis=(1, 2))
    assert len(image) < 800
    assert ink[-len(image) // 10 :].any()


def test_instants_of_equilibria_are_load_factors() -> None:
    times = np.array([0.0, 0.25, 0.5])
    job = order(rollup.planar(), PictureOptions(clock="load factor"))
    assert render_child.stamps(job, times)[1] == "load factor 0.25"
    job = order(rollup.planar())
    assert render_child.stamps(job, times)[1] == "t = 0.25 s"


@pytest.mark.usefixtures("opengl")
def test_a_mass_alone_stands_in_the_middle(tmp_path: Path) -> None:
    """Far from the origin, and large enough to be seen."""
    alone, options = (
        Frames(np.zeros(1), {}, {"m": frames.joint("point mass", np.ones((1, 3)))}),
        PictureOptions(size=SIZE),
    )
    image = pixels(pictures.render(alone, tmp_path / "a.png", options=options))
    width = SIZE[0] - decor.width(order(alone, options))
    eye = render_child.view(
        order(alone, options), (width, SIZE[1]), render_child.letters(order(alone, options))
    )
    rows, columns = np.nonzero((image[:, :width] < 200).any(axis=2))
    assert 10 < np.ptp(rows) < 40
    np.testing.assert_allclose(
        [columns.mean(), rows.mean()], camera.project(eye, np.ones(3)), atol=2.0
    )


def lines(*bodies: np.ndarray) -> Frames:
    """Lines (s,x,3) as frames."""
    return Frames(
        np.arange(len(bodies[0]), dtype=float),
        {f"{i}": line(body, {}, 0.01, body[0]) for i, body in enumerate(bodies)},
    )


def test_times_stand_at_the_point_that_moves_farthest() -> None:
    """The second body ends at a fixed hinge, where six times have no room beside each other; an
    arch is held at both ends.

    A single instant is compared with the reference.
    """
    turn = np.exp(0.25j * np.pi * np.arange(6))
    tip = np.column_stack([turn.real, turn.imag, 0 * turn.real])
    hinge = np.tile([3.0, 0.0, 0.0], (6, 1))
    crank, rod = (
        np.stack([0 * tip, 0.5 * tip, tip], axis=1),
        np.stack([tip, 0.5 * (tip + hinge), hinge], axis=1),
    )
    eye = camera.fit(
        np.array([[-1.0, -1.0, 0.0], [3.0, 1.0, 0.0]]), True, (800, 600), (50.0, 50.0, 50.0, 50.0)
    )
    np.testing.assert_allclose(
        render_child._farthest(eye, lines(crank, rod))[0], camera.project(eye, tip), atol=1e-9
    )
    x = np.linspace(-1.0, 1.0, 21)
    arch = np.stack([np.column_stack([x, height * (1 - x**2), 0 * x]) for height in (1.0, -1.0)])
    crowns = camera.project(eye, np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]))
    np.testing.assert_allclose(render_child._farthest(eye, lines(arch))[0], crowns, atol=1e-9)
    last = frames.select(lines(arch), np.array([1]))
    np.testing.assert_allclose(render_child._farthest(eye, last)[0], crowns[1:], atol=1e-9)


def test_times_cover_nothing_that_is_drawn() -> None:
    """Right of the first end stands a bar, right of the second a ball, the third is free, the
    fourth at the edge of the picture.

    At one place, from which no way leads outwards, they stand around it.
    """
    ink, height = np.zeros((600, 1000), dtype=bool), 15
    tips = np.array([[200.0, 300.0], [400.0, 300.0], [600.0, 300.0], [990.0, 300.0]])
    ink[250:350, 220:230] = ink[285:315, 402:430] = True
    words = [f"{k}.00 s" for k in range(4)]
    texts = render_child.place_marks(words, tips, tips - (10.0, 0.0), ink, height)
    assert [text.words for text in texts] == words[::-1]
    for text in texts:
        (left, top), (right, bottom) = box(text).astype(int)
        assert 0 <= left < right <= 1000
        assert not ink[top : bottom + 1, left : right + 1].any()
    places = np.array([text.place for text in texts[::-1]]) - tips
    assert places[2, 0] > 0.0
    assert places[2, 1] == 0.0
    assert all(place[1] != 0.0 or place[0] < 0.0 for place in places[[0, 1, 3]])
    together = render_child.place_marks(
        words, np.tile([500.0, 300.0], (4, 1)), np.tile([500.0, 300.0], (4, 1)), 0 * ink, height
    )
    boxes = [box(text) for text in together]
    assert not any(
        (a[0] < b[1]).all() and (a[1] > b[0]).all() for a, b in itertools.combinations(boxes, 2)
    )


def box(text: decor.Text) -> np.ndarray:
    """Upper left and lower right corner [pixel]."""
    half = np.array([decor.measure(text.words, text.height), text.height]) / 2.0
    return text.place + np.array([-half, half])


@pytest.mark.parametrize("planar", [True, False])
def test_the_scale_bar_is_as_long_as_its_length_along_every_axis(planar: bool) -> None:
    """Also in the unit that was typed; it has room in the key."""
    job = replace(
        order(
            rollup.planar() if planar else rollup.spatial(),
            PictureOptions(display=DisplayUnits(typed=("mm",))),
        ),
        planar=planar,
    )
    eye = render_child.view(job, (800, 600), 15)
    length, text = decor.bar(job, eye, 90.0)
    number, unit, *_ = text.split()
    assert unit == "mm"
    assert 36.0 - 1e-9 <= length <= 90.0
    ends = camera.project(
        eye,
        np.concatenate([np.zeros((1, 3)), 1e-3 * float(number) * np.eye(3)[: 2 if planar else 3]]),
    )
    np.testing.assert_allclose(np.linalg.norm(ends[1:] - ends[0], axis=1), length, rtol=1e-12)


@pytest.mark.usefixtures("opengl")
def test_animation(tmp_path: Path) -> None:
    path = pictures.animate(
        rollup.spatial(),
        tmp_path / "a.gif",
        count=5,
        rate=10.0,
        options=PictureOptions(field="curvature", size=SIZE),
    )
    with Image.open(path) as gif:
        assert (gif.n_frames, gif.size, gif.info["duration"], gif.info["loop"]) == (5, SIZE, 100, 0)
        shots = []
        for number in range(gif.n_frames):
            gif.seek(number)
            shots.append(np.asarray(gif.convert("RGB")).astype(int))
    assert (shots[0][350, 5] == 255).all(), "the ground is not white"
    scene, key = np.s_[60:, :370], np.s_[:, 400:]
    for before, after in itertools.pairwise(shots):
        assert (np.abs(after[scene] - before[scene]).max(axis=2) > 60).sum() > 100, (
            "the beam does not move"
        )
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
    """A stand-in for the program gets every pixel of every frame, with their size and rate; without
    it, what to install.
    """
    images = [np.full((6, 9, 3), shade, np.uint8) for shade in (0, 128, 255)]
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(video, "find_spec", lambda name: None)
    with pytest.raises(
        MissingFeature, match=r"ffmpeg.*none on the path.*apt-get install ffmpeg"
    ) as caught:
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


KILLED = (sys.executable, "-c", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")


@pytest.fixture
def hire(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Every picture is drawn by a process of its own, of this command or the usual one."""

    def choose(*command: str) -> None:
        monkeypatch.setattr(painter, "AT_HAND", [])
        monkeypatch.setattr(painter, "COMMAND", command or painter.COMMAND)

    return choose


@pytest.mark.skipif(sys.platform == "win32", reason="no signals")
def test_a_killed_child_is_a_missing_feature(tmp_path: Path, hire: Callable[..., None]) -> None:
    hire(*KILLED)
    for draw in (
        lambda: pictures.probe(),
        lambda: pictures.render(rollup.planar(), tmp_path / "a.png"),
        lambda: pictures.animate(rollup.planar(), tmp_path / "a.gif"),
    ):
        with pytest.raises(
            MissingFeature, match=r"died with code -11.*libegl1.*libosmesa6.*DISPLAY"
        ) as caught:
            draw()
        assert caught.value.exit_code == 7
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(
    sys.platform != "linux" or ctypes.util.find_library("OSMesa") is not None,
    reason="VTK falls back to OSMesa",
)
def test_vtk_without_any_opengl(monkeypatch: pytest.MonkeyPatch, hire: Callable[..., None]) -> None:
    """VTK told to use X where no X server runs: whatever it does then, this process lives and says
    what is missing.
    """
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkXOpenGLRenderWindow")
    monkeypatch.setenv("DISPLAY", "")
    hire()
    with pytest.raises(MissingFeature, match="libegl1"):
        pictures.probe()


@pytest.mark.usefixtures("opengl")
def test_a_process_at_hand_draws_all_that_is_ordered_and_ends(
    tmp_path: Path, hire: Callable[..., None]
) -> None:
    """Two pictures by one process; one that has died, as by the signal that stops a run, is
    replaced; in the end it is gone.
    """
    hire()
    with painter.at_hand():
        (one,) = painter.AT_HAND
        first = one.begin()
        for name in ("a.png", "b.png"):
            pictures.render(rollup.planar(), tmp_path / name, options=PictureOptions(size=SIZE))
            assert one.begin() is first
        np.testing.assert_array_equal(pixels(tmp_path / "a.png"), pixels(tmp_path / "b.png"))
        with pytest.raises(FmbsError, match="KeyError: 'mosaic'"):
            pictures._order(replace(order(rollup.planar()), layout="mosaic"))
        pictures.render(rollup.planar(), tmp_path / "c.png", options=PictureOptions(size=SIZE))
        assert one.begin() is first
        first.kill()
        first.wait()
        pictures.probe()
        last = one.begin()
        assert last is not first
    assert last.poll() is not None
    assert painter.AT_HAND == []


def test_other_failures_keep_their_words(hire: Callable[..., None]) -> None:
    hire("no-such-interpreter")
    with pytest.raises(MissingFeature, match="a program to draw with"):
        pictures.probe()
    hire(sys.executable, "-c", "print('7 ImportError: no pyvista here')")
    with pytest.raises(MissingFeature, match="no pyvista here"):
        pictures.probe()
    hire(sys.executable, "-c", "print('1 ValueError: bad picture')")
    with pytest.raises(FmbsError, match="ValueError: bad picture") as caught:
        pictures.probe()
    assert caught.value.exit_code == 1


def test_a_picture_that_takes_too_long_ends(
    hire: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(painter, "TIME_LIMIT", 0.5)
    hire(sys.executable, "-c", "import time; time.sleep(60)")
    with pytest.raises(FmbsError, match=r"a picture within 0\.5 s"):
        pictures.probe()


def test_limits_of_the_scale() -> None:
    planar = rollup.planar()
    assert colour_scales.limits([planar], "curvature") == (0.0, np.pi)
    assert colour_scales.limits([planar], "strain") == (-0.5, 0.5)
    lines = planar.bodies["beam"]
    error = np.geomspace(1e-12, 1e-2, 41)[None] * np.ones((7, 1))
    both = replace(
        planar,
        bodies={
            "beam": replace(lines, fields={"strain": lines.points[:, :, 0] - 0.25, "error": error})
        },
    )
    assert colour_scales.limits([both], "strain") == (-0.75, 0.75)
    assert colour_scales.limits([both], "error", logarithmic=True) == pytest.approx((1e-7, 1e-2))
    other = replace(planar, bodies={"beam": replace(lines, fields={"strain": error + 2.0})})
    assert colour_scales.limits([both, other], "strain") == (-2.01, 2.01)
    straight = replace(lines, fields={"strain": 1e-18 * lines.points[:, :, 0]})
    still = replace(planar, bodies={"beam": straight})
    assert colour_scales.is_round_off(still, "strain")
    assert colour_scales.limits([both, still], "strain") == (-0.75, 0.75)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_round_off_of_straight_bodies_is_zero_and_says_so(size: float) -> None:
    """Curvatures are 1 / length, strains are none: the same beam in every unit; what is a million
    times as large is drawn.
    """
    planar = rollup.planar()
    beam = planar.bodies["beam"]
    noise = np.full(beam.points.shape[:2], 1e-16)
    lengths = {name: size * getattr(beam, name) for name in ("points", "reference", "size")}
    for factor, silent in ((1.0, True), (1e6, False)):
        still = replace(
            beam, **lengths, fields={"curvature": factor * noise / size, "strain": factor * noise}
        )
        frames = replace(planar, bodies={"beam": still})
        for name, label in (("curvature", "curvature [1/m]"), ("strain", "axial strain [-]")):
            job = order(frames, PictureOptions(name))
            assert job.scale.label == label + (", round-off" if silent else "")
            assert job.frames.bodies["beam"].fields[name].any() != silent
            assert not silent or job.scale.limits == (0.0, 1.0)


def test_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'curvature'"):
        pictures.render(
            rollup.planar(), tmp_path / "a.png", options=PictureOptions(field="curvatur")
        )
    with pytest.raises(InputError, match=r"ending in \.png"):
        pictures.render(rollup.planar(), tmp_path / "a.bmp")
    with pytest.raises(InputError, match=r"ending in \.gif or \.mp4"):
        pictures.animate(rollup.planar(), tmp_path / "a.avi")
    with pytest.raises(InputError, match="frames a second"):
        pictures.animate(rollup.planar(), tmp_path / "a.gif", rate=1000.0)
    with pytest.raises(InputError, match="200 to 8000 pixels"):
        PictureOptions(size=(10, 10))
    with pytest.raises(InputError, match="logarithmic"):
        PictureOptions(logarithmic=True, limits=(0.0, 1.0))


def test_nothing_heavy_is_imported_before_it_is_used() -> None:
    heavy = {"pyvista", "vtk", "vtkmodules", "matplotlib", "meshio", "PIL"}
    code = f"import sys, fmbs_skfem.results; print(sorted({heavy} & {{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    "planar, aim, begin",
    [(True, 1.0, -1.0), (True, -1.0, -1.0), (False, 1.0, 0.0), (False, -1.0, -1.0)],
)
def test_arrows_of_forces_in_space_are_before_what_they_push(
    planar: bool, aim: float, begin: float
) -> None:
    """One that points to the eye begins at its place; all others end there."""
    assert drawing.begins(np.array([0.0, 0.0, aim]), planar) == begin


@pytest.mark.parametrize(
    "aim, planar, turn",
    [((0, -9.81, 0), True, -90), ((0, 0, -9.81), False, -90), ((9.81, 0, 0), False, -30)],
)
def test_the_key_shows_where_gravity_points_in_the_picture(
    aim: tuple[float, float, float], planar: bool, turn: float
) -> None:
    """Down in the plane and in space, along the falling x axis of the isometric view; a gravity
    that begins later as well.
    """
    arrow = frames.Mark("gravity", np.empty((7, 0)), np.linspace(0.0, 1.0, 7)[:, None] * aim)
    marker = decor.turned("o", arrow, planar)
    across, along = marker.get_user_transform().transform((1.0, 0.0))
    assert np.degrees(np.arctan2(along, across)) == pytest.approx(turn)


def test_the_key_leaves_out_loads_that_never_act() -> None:
    planar = rollup.planar()
    tip = planar.bodies["beam"].points[:, -1]
    loads = {"none": frames.Mark("force", tip, 0.0 * tip), "some": frames.Mark("moment", tip, tip)}
    handles = decor._handles(order(replace(planar, marks={**planar.marks, **loads})))
    assert [one.get_label() for one in handles] == ["beam", "clamp", "moment"]
