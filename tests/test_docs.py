"""The documentation site: built without a warning, whole, read without network, drawn by a browser
on wide and narrow screens.
"""

from __future__ import annotations

import dataclasses
import fcntl
import html
import importlib
import inspect
import json
import re
import subprocess
import sys
import threading
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote, urlsplit

import numpy as np
import pytest
from PIL import Image

from fmbs_skfem import scenes
from fmbs_skfem.bodies import Given, cable
from fmbs_skfem.shapes import plate_meshes

from . import pages
from .browser import PROGRAM, Browser, browser

for _package in ("sphinx", "furo", "myst_parser", "ziamath"):
    pytest.importorskip(_package, reason="the site is built with the extra docs")

DOCS = Path(__file__).resolve().parents[1] / "docs"
sys.path.insert(0, str(DOCS / "site"))

import docstrings  # noqa: E402  all of docs/site
import gallery  # noqa: E402
import reference_pages  # noqa: E402
import tutorials  # noqa: E402

#: (n,), (s, n), (cells + 1, 3), (3, ...), (...)
SHAPE = re.compile(r"\([\w+*/ -]*(?:,[^()]*|\.\.\.)\)")
FETCHED = re.compile(r"(?:url\(|@import|fetch\(|import\()\s*[\"']?https?:")
ARRAY = re.compile(r"ndarray|csr_array|Array\b")


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages, built once for all processes of the tests."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if base.name.startswith("popen-") else base) / "site"
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "built").exists():
            done = subprocess.run(
                [sys.executable, DOCS / "build.py", "--no-gallery", "--out", folder],
                capture_output=True,
                text=True,
            )
            assert done.returncode == 0, done.stdout + done.stderr
            (folder / "built").touch()
    return folder / "html"


class Links(HTMLParser):
    """What a page has anchors for, links to and loads."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = dict(attrs)
        self.anchors |= {text for key in ("id", "name") if (text := known.get(key))}
        if tag == "a" and (link := known.get("href")):
            self.links.append(link)
        elif tag != "a":
            canonical = known.get("rel") == "canonical"
            self.loads += [
                text
                for key in ("src", "href", "data")
                if (text := known.get(key)) and not canonical
            ]


def test_every_link_leads_somewhere_and_nothing_is_loaded_from_outside(site: Path) -> None:
    pages = {path.resolve(): Links(path) for path in site.rglob("*.html")}
    assert len(pages) > 60
    for path, page in pages.items():
        for link in [*page.links, *page.loads]:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                assert link not in page.loads, (path, link)
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert target.exists(), (path, link)
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].anchors, (path, link)
    styles = [*site.rglob("*.css"), *site.rglob("*.js")]
    assert not [
        path
        for path in styles
        if re.search(r"(?:url\(|@import|fetch\(|import\()\s*[\"']?https?:", path.read_text("utf-8"))
    ]


def test_every_public_object_is_in_the_reference(site: Path) -> None:
    text = zlib.decompress((site / "objects.inv").read_bytes().split(b"\n", 4)[4]).decode()
    listed = {line.split()[0] for line in text.splitlines() if " py:" in line}
    homes = reference_pages.homes(dict(reference_pages.public_modules()))
    public = {homes.get(id(own), f"fmbs_skfem.{path}") for path, own in public_objects()}
    assert len(public) > 500
    assert public - listed == set()
    of_types = (
        "Runtime representation of an annotated type",
        "Built-in immutable sequence",
        "new empty dictionary",
    )
    assert [
        path.name
        for path in (site / "api").glob("*.html")
        if any(text in path.read_text("utf-8") for text in of_types)
    ] == []


def test_the_index_of_the_reference_has_a_line_on_every_module(site: Path) -> None:
    """The first sentence of its docstring, beside the link to its page."""
    text = (site / "api" / "index.html").read_text(encoding="utf-8")
    lines = dict(
        re.findall(
            r'<td><p><a [^>]*href="([^"]+)\.html".*?</td>\s*<td><p>(.*?)</p></td>', text, re.DOTALL
        )
    )
    assert list(lines) == list(dict(reference_pages.public_modules()))
    for path, line in lines.items():
        said = html.unescape(re.sub("<[^>]+>", "", line)).replace("’", "'")
        known = " ".join(
            (importlib.import_module(f"fmbs_skfem.{path}").__doc__ or "").split()
        ).replace("`", "")
        assert len(said) > 20, path
        assert re.match(rf"{re.escape(said)}[.?]", known), path


def test_the_gallery_has_every_example_under_one_kind(site: Path) -> None:
    text = (site / "gallery" / "index.html").read_text(encoding="utf-8").partition("<article")[2]
    sections = re.findall(r"<h2>(.*?)<a(.*?)</section>", text, re.DOTALL)
    shown = {
        title: list(dict.fromkeys(re.findall(r'href="([^"#]+)\.html"', own)))
        for title, own in sections
    }
    assert list(shown) == list(gallery.KINDS)[::-1]
    assert all(len(own) > 1 for own in shown.values())
    assert sorted(name for own in shown.values() for name in own) == sorted(
        name.replace("/", "-") for name in gallery.names()
    )
    assert "gripper" in shown["Contact"]
    assert "lqr_arm" in shown["Control and plants"]
    assert "roof" in shown["Plates and shells"]


@pytest.mark.parametrize("name", ["picture.png", "outputs.png"])
def test_pictures_of_cards_show_what_is_drawn_alone(tmp_path: Path, name: str) -> None:
    """White margins go, of scenes the title and the key as well."""
    pixels = np.full((800, 1120, 3), 255, np.uint8)
    pixels[100:400, 50:650] = (10, 80, 160)
    pixels[10:30, 5:200] = pixels[60:500, 940:960] = 0
    Image.fromarray(pixels).save(tmp_path / name)
    assert gallery.cropped(tmp_path / name).size == (
        (600, 300) if name == "picture.png" else (955, 490)
    )


@pytest.mark.skipif(PROGRAM is None, reason="no Chromium")
def test_pages_fit_wide_and_narrow_windows_without_errors(site: Path, tmp_path: Path) -> None:
    with browser(tmp_path) as chromium:
        for page in sorted(site.rglob("*.html")):
            for width, needed in chromium.widths(page, (1280, 400)).items():
                assert needed <= width, (page.name, width, needed)
            assert chromium.wrong == [], page.name


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a server of a folder, ended behind the block."""
    handler = partial(SilentHandler, directory=folder)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever).start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()


class SilentHandler(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        """Requests are not printed."""


def found(chromium: Browser, base: str, word: str) -> list[str]:
    """Titles of what a search finds, once all of it stands on the page."""
    chromium.load(f"{base}/search.html?q={word}")
    chromium.run(
        "new Promise(done => { const look = () => document.querySelector('.search-summary')?.innerText"
        " ? done() : setTimeout(look, 20); look() })"
    )
    titles: list[str] = chromium.run(
        "[...document.querySelectorAll('#search-results li > a')].map(each => each.innerText)"
    )
    return titles


@pytest.mark.skipif(PROGRAM is None, reason="no Chromium")
def test_a_search_finds_pages_without_errors_from_a_disk_and_from_a_server(
    site: Path, tmp_path: Path
) -> None:
    """Summaries are fetched from pages, which a page from a disk may not."""
    with browser(tmp_path) as chromium, served(site) as address:
        for base in (site.as_uri(), address):
            titles = found(chromium, base, "ECSW")
            assert {"reduction.hyper.ecsw", "Architecture"} <= set(titles)
            assert found(chromium, base, "zzyzx") == []
        for word in ("contact", "sweep", "reduce"):
            assert found(chromium, address, word)
            links = chromium.run(
                "[...document.querySelectorAll('#search-results li > a')].map(each => each.href)"
            )
            behind = [
                any(one in link for one in ("/api/", "architecture", "CONTRIBUTING"))
                for link in links
            ]
            assert behind == sorted(behind), (word, links)
            assert not behind[0]
        assert found(chromium, address, "GeneralizedAlpha")[0].endswith("GeneralizedAlpha")
        found(chromium, address, "ECSW")
        summary = "[...document.querySelectorAll('#search-results p.context')].some(each => each.innerText.includes('ECSW'))"
        chromium.run(
            f"new Promise(done => {{ const look = () => {summary} ? done() : setTimeout(look, 20); look() }})"
        )
        assert chromium.wrong == []


@pytest.mark.skipif(PROGRAM is None, reason="no Chromium")
def test_blocks_are_copied_by_a_click_without_the_prompt(site: Path, tmp_path: Path) -> None:
    """Each block has a button; the clipboard then has the block as it stands in the source of the
    page.
    """
    with browser(tmp_path) as chromium:
        chromium.ask(
            "Browser.grantPermissions",
            permissions=["clipboardReadWrite", "clipboardSanitizedWrite"],
        )
        chromium.resize(1280)
        chromium.load(site / "plant.html")
        count = "document.querySelectorAll('article {}').length"
        assert (
            chromium.run(count.format("button.copy"))
            == chromium.run(count.format("div.highlight pre"))
            > 2
        )
        for language in ("yaml", "python"):
            chromium.click(f".highlight-{language} button.copy")
            copied = chromium.run("navigator.clipboard.readText()")
            assert copied == pages.blocks("docs/plant.md", language)[0].rstrip()
        assert (
            chromium.run("document.querySelector('.highlight-python button.copy').innerText")
            == "Copied"
        )
        session = "$ fmbs run a.yaml \\\n    --out b\nt = 1 s\n$ fmbs view b"
        assert (
            chromium.run(f"typed({json.dumps(session)})")
            == "fmbs run a.yaml \\\n    --out b\nfmbs view b"
        )
        assert chromium.wrong == []


def test_sources_of_the_theory_are_those_of_the_code() -> None:
    """Every DOI of the bibliography stands in a docstring of the package, an example or a
    benchmark, so that none is made up.
    """
    listed = set(
        re.findall(
            r"\[doi ([^\]]+)\]", (DOCS / "theory" / "bibliography.md").read_text(encoding="utf-8")
        )
    )
    texts = [
        path
        for folder in ("src", "examples", "benchmarks")
        for path in (DOCS.parent / folder).rglob("*.py")
    ]
    known = "".join(path.read_text(encoding="utf-8") for path in texts)
    assert len(listed) > 15
    assert {doi for doi in listed if doi not in known} == set()


def test_every_doi_has_the_form_of_one() -> None:
    """10.PREFIX/SUFFIX, in pages, in docstrings and in links, which end where it ends."""
    root = DOCS.parent
    texts = [
        *root.glob("*.md"),
        *DOCS.rglob("*.md"),
        *(root / "src").rglob("*.py"),
        *(root / "verification").rglob("*.py"),
        root / "CITATION.cff",
    ]
    found = [
        (path.name, doi)
        for path in texts
        for doi in re.findall(
            r"(?:doi\.org/|\bdoi[: ]\s?)([^\s\])\"'`>|,;]+)",
            path.read_text(encoding="utf-8"),
            re.IGNORECASE,
        )
        if doi[0].isdigit() or "/" in doi
    ]
    assert len(found) > 100
    assert [one for one in found if not re.fullmatch(r"10\.\d{4,9}/\S*[\w)][.:]?", one[1])] == []


def test_meshes_are_written_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its Python, and bodies of both files: an arc of 0.5 m, and a sheet of 2 m by 1 m."""
    monkeypatch.chdir(tmp_path)
    pages.run("docs/own_mesh.md")
    bow = cable("bow", tmp_path / "bow.msh", Given(EA=1.0, EI=1.0, rhoA=2.0), dim=2)
    assert bow.total_mass == pytest.approx(1.0, rel=1e-4)
    assert {"left", "right"} <= set(
        plate_meshes.read(tmp_path / "sheet.vtu", planar=True).edge_groups
    )


def test_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its scene, and its lines of Python; the reduced model follows to 1 mm."""
    (scene,) = pages.blocks("README.md", "yaml")
    (code,) = pages.blocks("README.md")
    assert max(len(block.strip().splitlines()) for block in (scene, code)) <= 10
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "beam_20.msh").write_bytes(
        (DOCS.parent / "meshes" / "beam_20.msh").read_bytes()
    )
    (tmp_path / "pendulum.yaml").write_text(scene)
    monkeypatch.chdir(tmp_path)
    known = pages.run("README.md", [code])
    assert known["small"].report["position_error"] < 1e-3
    assert known["again"].outputs["tip_y"][-1] == pytest.approx(
        known["full"].outputs["tip_y"][-1], abs=1e-3
    )


def test_the_readme_is_read_in_three_minutes() -> None:
    """900 words as `wc -w` counts them: what is more belongs into a page."""
    assert len((DOCS.parent / "README.md").read_text(encoding="utf-8").split()) <= 900


def test_tutorials_run_and_come_out_as_they_say() -> None:
    """Every cell of every page; a mode is the frequency of the motion, a reduced model follows,
    true errors lie in their bands.
    """
    found = {}
    for path in sorted(tutorials.PAGES.glob("*.md")):
        page, found[path.stem] = tutorials.execute(
            tutorials.cells(path.read_text(encoding="utf-8")), path.name
        )
        stored = json.loads(tutorials.notebook(page))["cells"]
        assert [cell["cell_type"] == "code" for cell in stored] == [cell.code for cell in page]
        assert any(cell.printed for cell in page)
    first, reduced, swept = found["first_system"], found["reduction"], found["sweep"]
    assert first["sunk"] == pytest.approx(first["linear"], rel=0.03)
    assert 1 / np.diff(first["crossings"]).mean() == pytest.approx(first["frequency"], rel=5e-3)
    assert reduced["error"] < 1e-4
    checked = swept["found"].holdout
    assert all(
        one.low <= true <= one.high
        for one, true in zip(checked.predictions, checked.true, strict=True)
    )


def test_a_notebook_runs_where_a_reader_has_the_examples(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file that the page offers, in the folder of `fmbs demo --copy`, by a kernel: what it
    prints, and its picture.
    """
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    page = Links(site / "tutorials" / "first_system.html")
    (link,) = [link for link in page.links if link.endswith(".ipynb")]
    subprocess.run(
        [sys.executable, "-m", "fmbs_skfem", "demo", "--copy"],
        cwd=tmp_path,
        check=True,
        capture_output=True,
    )
    book = nbformat.read(site / "tutorials" / unquote(link), as_version=4)
    nbformat.validate(book)
    # as a reader has it: the kernel chooses what draws
    monkeypatch.delenv("MPLBACKEND", raising=False)
    folder = {"metadata": {"path": str(tmp_path / "fmbs-examples")}}
    nbclient.NotebookClient(book, timeout=900, kernel_name="python3", resources=folder).execute()
    outputs = [output for cell in book.cells if cell.cell_type == "code" for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    mode, motion = map(float, re.findall(r"([\d.]+) Hz", outputs[-1].text))
    assert motion == pytest.approx(mode, rel=5e-3)


def public_objects() -> list[tuple[str, object]]:
    return [
        (f"{path}.{name}", getattr(importlib.import_module(f"fmbs_skfem.{path}"), name))
        for path, names in reference_pages.public_modules()
        for name in names
    ]


def test_public_objects_say_what_they_are_with_shapes() -> None:
    """A docstring for all, and a shape in axis letters where arrays go in or come out."""
    silent, shapeless = [], []
    for path, own in public_objects():
        if not (isinstance(own, type) or inspect.isroutine(own)):
            continue
        text = own.__doc__ or ""
        if not text or text.startswith(f"{getattr(own, '__name__', '')}("):
            silent.append(path)
        if isinstance(own, type) and dataclasses.is_dataclass(own):
            beside, declared = docstrings.comments(own), docstrings.shapes(own)
            for field in dataclasses.fields(own):
                known = beside.get(field.name, "") + declared.get(field.name, "") + text
                if (
                    ARRAY.search(str(field.type))
                    and not field.name.startswith("_")
                    and not SHAPE.search(known)
                ):
                    shapeless.append(f"{path}.{field.name}")
        elif ARRAY.search(
            str(getattr(inspect.unwrap(own), "__annotations__", {}))
        ) and not SHAPE.search(text):
            shapeless.append(path)
    assert (silent, shapeless) == ([], [])


def test_models_of_other_codes_run_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three scenes: a bent rod of Timoshenko (Roark: GJ = 0.229 w^3 h G), and sqrt(l^2 - r^2) of a
    slider at a quarter turn.
    """
    monkeypatch.chdir(DOCS.parent)
    pendulum, torsion, crank = (
        scenes.loads(text, DOCS.parent).run().outputs
        for text in pages.blocks("docs/coming_from.md", "yaml")
    )
    assert (
        -0.75 * 9.81 * 0.1**2 < pendulum["tip_y"][-1] < -0.5 * 9.81 * 0.1**2
    )  # between a rigid rod and one that bends freely
    w, h, E = 0.02, 0.04, 210e9
    assert torsion["tip_z"][-1] == pytest.approx(-50 / (3 * E * w * h**3 / 12), rel=5e-3)
    assert torsion["turned"][-1] == pytest.approx(20 / (0.229 * h * w**3 * E / 2.6), rel=5e-3)
    assert crank["stroke"][-1] == pytest.approx(np.sqrt(0.3**2 - 0.1**2), abs=1e-6)
