"""Headless Chromium over its debugging pipe: what a page says on the console, and how wide it is."""

from __future__ import annotations

import base64
import fcntl
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PROGRAM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
#: no request of its own leaves the machine, whose network may be closed
QUIET = (
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
OPTIONS = ("--headless", "--no-sandbox", "--hide-scrollbars", "--remote-debugging-pipe", *QUIET)
#: without WebGL, and with it in software
FLAT, DRAWS = (
    ("--disable-gpu",),
    ("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
)
WRONG = {"Runtime.exceptionThrown", "Log.entryAdded"}
#: of a busy machine, when tests read what was drawn
SLOW_DRIVER = "GL Driver Message (OpenGL, Performance"
LAYOUT = "document.documentElement.scrollWidth"


class Browser:
    """One tab: messages go out on `pen` and come in on `ear`, each a JSON object that ends with a
    zero byte.
    """

    def __init__(self, ear: int, pen: int) -> None:
        self.ear, self.pen, self.rest, self.number, self.session = ear, pen, b"", 0, {}
        self.wrong: list[str] = []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = {
            "sessionId": self.ask("Target.attachToTarget", targetId=target, flatten=True)[
                "sessionId"
            ]
        }
        for domain in ("Page", "Runtime", "Log"):
            self.ask(f"{domain}.enable")

    def hear(self) -> dict[str, Any]:
        """The next message; what speaks against a page is kept."""
        while b"\0" not in self.rest:
            read = os.read(self.ear, 1 << 16)
            assert read, "the browser has ended"
            self.rest += read
        text, _, self.rest = self.rest.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        called = message.get("method") == "Runtime.consoleAPICalled" and message["params"][
            "type"
        ] in ("error", "warning")
        text = json.dumps(message.get("params"))
        if (called or message.get("method") in WRONG) and SLOW_DRIVER not in text:
            self.wrong.append(text)
        return message

    def ask(self, method: str, **values: Any) -> dict[str, Any]:
        """The answer to a command."""
        self.number += 1
        os.write(
            self.pen,
            json.dumps(
                {"id": self.number, "method": method, "params": values, **self.session}
            ).encode()
            + b"\0",
        )
        while (message := self.hear()).get("id") != self.number:
            pass
        assert "error" not in message, message
        found: dict[str, Any] = message["result"]
        return found

    def resize(self, width: int, height: int = 900) -> None:
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def widths(self, page: Path, wanted: tuple[int, ...]) -> dict[int, int]:
        """How wide a page is in windows of wanted widths [px]; it is loaded in the first one."""
        found = {}
        for k, width in enumerate(wanted):
            self.resize(width)
            if k == 0:
                self.load(page)
            found[width] = int(self.run(LAYOUT))
        return found

    def load(self, page: Path | str) -> None:
        """A page, a file or an address, up to its load event."""
        self.ask("Page.navigate", url=page if isinstance(page, str) else page.as_uri())
        while self.hear().get("method") != "Page.loadEventFired":
            pass

    def run(self, code: str) -> Any:
        """The value of an expression in the page, awaited where it is a promise."""
        found = self.ask("Runtime.evaluate", expression=code, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def click(self, selector: str) -> None:
        """The middle of an element, by the mouse, as a person would."""
        place = f"document.querySelector({json.dumps(selector)})"
        x, y = self.run(
            f"({place}.scrollIntoView({{block: 'center', behavior: 'instant'}}), (b => [b.x + b.width / 2, b.y + b.height / 2])"
            f"({place}.getBoundingClientRect()))"
        )
        for kind in ("mousePressed", "mouseReleased"):
            self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def press(self, key: str, **more: Any) -> None:
        """A key, down and up."""
        for kind in ("keyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, **more)

    def picture(self, path: Path) -> Path:
        """The page as it is seen, as a PNG."""
        path.write_bytes(base64.b64decode(self.ask("Page.captureScreenshot")["data"]))
        return path


@contextmanager
def browser(folder: Path, options: tuple[str, ...] = FLAT) -> Iterator[Browser]:
    """A browser that is ended behind the block; `folder` takes its profile."""
    assert PROGRAM is not None
    (listens, pen), (ear, speaks) = os.pipe(), os.pipe()
    ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (listens, speaks)]

    def connect() -> None:
        os.dup2(ends[0], 3)
        os.dup2(ends[1], 4)

    command = [PROGRAM, *OPTIONS, *options, f"--user-data-dir={folder}"]
    process = subprocess.Popen(
        command, preexec_fn=connect, pass_fds=(3, 4), stderr=subprocess.DEVNULL
    )
    for end in (listens, speaks, *ends):
        os.close(end)
    try:
        yield Browser(ear, pen)
    finally:
        process.terminate()
        process.wait()
        os.close(ear)
        os.close(pen)
