"""A headless Chromium for tests of pages, driven over a pipe (no port, no network); the one found on this machine.

with browser(tmp_path) as page:
    page.open(report)
    assert page.value("document.title") == "..."
    assert page.problems == []
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
)  # fmt: skip
ANSWER_S = 30.0


def found_browser() -> str:
    """Return the path of Chromium; skip the test where there is none."""
    for name in NAMES:
        if path := shutil.which(name):
            return path
    pytest.skip(f"needs one of {', '.join(NAMES)}, and none is installed: `sudo apt install chromium`")


class Page:
    """One page. `problems`: errors on its console, exceptions and refused or attempted requests since it was opened."""

    def __init__(self, to_browser: int, from_browser: int) -> None:
        self.problems: list[str] = []
        self._out, self._in = to_browser, from_browser
        self._buffer = b""
        self._number = 0
        self._loaded = False
        self._session = ""
        target = self._ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._ask(f"{domain}.enable")

    def open(self, file: Path, *, width: int = 1280, height: int = 800) -> None:
        """Open a file in a window of this size (CSS pixels), and wait until it is loaded."""
        self.size(width, height)
        self.problems.clear()
        self._loaded = False
        self._ask("Page.navigate", url=file.resolve().as_uri())
        self._until(lambda: self._loaded, "the page did not load")

    def size(self, width: int, height: int) -> None:
        self._ask(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600
        )

    def looks(self, *, dark: bool = False, printed: bool = False) -> None:
        """Choose the reader's colours, and whether the page is printed."""
        features = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self._ask("Emulation.setEmulatedMedia", media="print" if printed else "screen", features=features)

    def scripts(self, *, allowed: bool) -> None:
        """Choose whether scripts of pages run."""
        self._ask("Emulation.setScriptExecutionDisabled", value=not allowed)

    def value(self, expression: str) -> Any:
        """Return the value of a JavaScript expression on the page."""
        answer = self._ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait_for(self, expression: str) -> None:
        """Wait until an expression is true."""
        self._until(lambda: self.value(expression) is True, f"it did not become true: {expression}")

    def press(self, key: str, code: int) -> None:
        """Press and release a key."""
        for kind in ("keyDown", "keyUp"):
            self._ask("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def click(self, x: float, y: float) -> None:
        """Click at a place of the window (CSS pixels)."""
        for kind in ("mousePressed", "mouseReleased"):
            self._ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1, buttons=1)

    def screenshot(self, *, whole: bool = True) -> bytes:
        """Return the page as PNG."""
        return base64.b64decode(self._ask("Page.captureScreenshot", captureBeyondViewport=whole)["data"])

    def _until(self, done: Any, what: str) -> None:
        deadline_s = time.monotonic() + ANSWER_S
        while not done():
            assert time.monotonic() < deadline_s, what
            self._read(0.05)

    def _ask(self, method: str, **params: Any) -> dict[str, Any]:
        self._number += 1
        number = self._number
        order = {"id": number, "method": method, "params": params}
        if self._session:
            order["sessionId"] = self._session
        os.write(self._out, json.dumps(order).encode() + b"\0")
        deadline_s = time.monotonic() + ANSWER_S
        while True:
            for message in self._read(0.5):
                if message.get("id") == number:
                    assert "error" not in message, f"{method}: {message['error']}"
                    return dict(message["result"])
            assert time.monotonic() < deadline_s, f"no answer to {method}"

    def _read(self, wait_s: float) -> list[dict[str, Any]]:
        if not select.select([self._in], [], [], wait_s)[0]:
            return []
        data = os.read(self._in, 1 << 20)
        assert data, "the browser has ended"
        *complete, self._buffer = (self._buffer + data).split(b"\0")
        messages = [json.loads(message) for message in complete]
        for message in messages:
            self._note(message.get("method", ""), message.get("params", {}))
        return messages

    def _note(self, method: str, params: dict[str, Any]) -> None:
        if method == "Page.loadEventFired":
            self._loaded = True
        elif method == "Runtime.exceptionThrown":
            self.problems.append(str(params["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.problems.append(str(params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.problems.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent" and not params["request"]["url"].startswith("file:"):
            self.problems.append(f"it asked for {params['request']['url']}")


@contextlib.contextmanager
def browser(folder: Path) -> Iterator[Page]:
    """Start a browser of its own, with an empty profile below `folder`; end it and its children afterwards."""
    program = found_browser()
    orders, to_browser = os.pipe()
    from_browser, answers = os.pipe()
    profile = folder / "chromium"
    profile.mkdir()
    # Chromium reads orders from descriptor 3 and answers on 4.
    script = f'exec 3<&{orders} 4>&{answers}; exec "$@"'
    process = subprocess.Popen(
        ["bash", "-c", script, "-", program, *FLAGS, "--remote-debugging-pipe", f"--user-data-dir={profile}"],
        pass_fds=(orders, answers), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(orders)
    os.close(answers)
    try:
        page = Page(to_browser, from_browser)
        yield page
        page._session = ""
        page._ask("Browser.close")
        process.wait(10.0)
    finally:
        process.kill()
        process.wait()
        os.close(to_browser)
        os.close(from_browser)
