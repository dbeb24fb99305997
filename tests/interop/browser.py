"""Drive Debian's chromium in tests, through the DevTools protocol over its WebSocket: act like a user, wait for visible results.

Source: https://chromedevtools.github.io/devtools-protocol.
"""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import psutil
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tests.waiting import wait_until

CHROMIUM = shutil.which("chromium")
PATIENCE = 200.0  # seconds to wait for a state; a busy machine may take many

_FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-component-update",
    "--remote-debugging-port=0",
    "--hide-scrollbars",
)

_WAIT = """
new Promise((resolve, reject) => {
  const end = performance.now() + %d;
  const look = () => {
    let found;
    try { found = (() => { %s })(); } catch (error) { found = undefined; }
    if (found) resolve(found);
    else if (performance.now() > end) reject(new Error("not reached; the page shows: " + document.body.innerText.slice(0, 2000)));
    else setTimeout(look, 30);
  };
  look();
})
"""

_ARM = """
window.clickedByTest = window.pressedByTest = false;
let pressed = null;
addEventListener("pointerdown", ({ clientX: x, clientY: y }) => {
  const e = %s, r = e?.getBoundingClientRect();
  pressed = e && r.left <= x && x <= r.right && r.top <= y && y <= r.bottom ? e : null;
  window.pressedByTest = Boolean(pressed);
}, { capture: true, once: true });
addEventListener("click", () => { window.clickedByTest = Boolean(pressed?.isConnected); }, { capture: true, once: true });
"""


class Page:
    """A browser tab. ``script`` is JavaScript; ``find`` is a CSS selector."""

    def __init__(
        self,
        url: str,
        *,
        width: int = 1200,
        height: int = 760,
        dark: bool = False,
        flags: tuple[str, ...] = (),
    ) -> None:
        assert CHROMIUM
        self._folder = tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [
                CHROMIUM,
                *_FLAGS,
                *flags,
                f"--user-data-dir={self._folder.name}",
                f"--window-size={width},{height}",
                "about:blank",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._numbers = itertools.count(1)
        self.errors: list[str] = []
        """Errors that the page logged: exceptions, and violations of its Content-Security-Policy."""
        try:
            self._stack = contextlib.ExitStack()
            self._socket = self._stack.enter_context(self._connect())
            for domain in ("Page", "Runtime", "Log"):
                self.call(f"{domain}.enable")
            self.call(
                "Emulation.setDeviceMetricsOverride",
                width=width,
                height=height,
                deviceScaleFactor=1,
                mobile=False,
            )
            self.call(
                "Emulation.setEmulatedMedia",
                features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}],
            )
            self.open(url)
        except BaseException:
            self.close()
            raise

    def open(self, url: str) -> None:
        """Navigate to a URL."""
        self.call("Page.navigate", url=url)
        self.wait("return document.readyState === 'complete'")

    def reload(self) -> None:
        """Reload the page; return once the new page is loaded."""
        self.evaluate("window.isLeftByTest = true")
        self.call("Page.reload")
        self.wait("return !window.isLeftByTest && document.readyState === 'complete'")

    def call(self, method: str, **params: Any) -> Any:
        """Call a protocol method; return its result."""
        answer = self._answer(method, params)
        assert "error" not in answer, answer
        return answer["result"]

    def _answer(self, method: str, params: dict[str, Any]) -> dict[str, Any]:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            answer: dict[str, Any] = json.loads(self._socket.recv(timeout=PATIENCE * 2))
            if answer.get("id") == number:
                return answer
            self._event(answer)

    def _event(self, event: dict[str, Any]) -> None:
        params = event.get("params", {})
        if event["method"] == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description") or details["text"])
        elif event["method"] == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.errors.append(params["entry"]["text"])

    def evaluate(self, script: str) -> Any:
        """Return the value of an expression; if it is a promise, await it."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, script: str) -> Any:
        """Return the value of a function body once it is true, in this page or in one that is loaded in the meantime."""
        params = {
            "expression": _WAIT % (PATIENCE * 1000, script),
            "awaitPromise": True,
            "returnByValue": True,
        }
        end = time.monotonic() + PATIENCE
        # Navigation discards the promise together with the page.
        while "error" in (answer := self._answer("Runtime.evaluate", params)):
            assert time.monotonic() < end, answer
            time.sleep(0.05)
        assert "exceptionDetails" not in answer["result"], answer["result"]["exceptionDetails"]
        return answer["result"]["result"].get("value")

    def wait_text(self, find: str, text: str) -> str:
        """Wait until a visible element contains this text; return all of the element's text."""
        return str(self.wait(f"const e = {_finding(find, text)}; return e && e.textContent"))

    def click(self, find: str, text: str = "") -> None:
        """Click the first visible element that contains this text, once it exists, with mouse events.

        Repeat the click if the element moves away before the press, as a user would.
        """
        end = time.monotonic() + PATIENCE
        while True:
            self._arm(find, text)
            for kind in ("mousePressed", "mouseReleased"):
                self._mouse(kind, find, text)
            # A page that was just loaded has no record of the click that loaded it.
            if self.evaluate("window.clickedByTest !== false"):
                return
            assert time.monotonic() < end, f"the clicks do not reach {find} {text!r}"

    def press(self, find: str, text: str = "") -> None:
        """Press the mouse button on an element and hold it; press again if the element has moved away."""
        end = time.monotonic() + PATIENCE
        while True:
            self._arm(find, text)
            self._mouse("mousePressed", find, text)
            if self.evaluate("window.pressedByTest"):
                return
            assert time.monotonic() < end, f"the mouse does not reach {find} {text!r}"
            self._mouse("mouseReleased", find, text)

    def release(self, find: str, text: str = "") -> None:
        """Release the mouse button on an element."""
        self._mouse("mouseReleased", find, text)

    def _arm(self, find: str, text: str) -> None:
        self.evaluate("{%s}" % (_ARM % _finding(find, text)))

    def _mouse(self, kind: str, find: str, text: str) -> None:
        x, y = self.wait(
            f"const e = {_finding(find, text)}; if (!e || e.disabled) return null; e.scrollIntoView({{block: 'nearest'}});"
            "const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]"
        )
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def type(self, find: str, text: str) -> None:
        """Replace the text in an input, with key events."""
        self.wait(f"const e = {_finding(find)}; if (!e) return false; e.focus(); e.select(); return true")
        self.call("Input.insertText", text=text)

    def choose(self, find: str, value: str) -> None:
        """Choose an option of a <select>, once it exists."""
        choice = json.dumps(value)
        self.wait(
            f"const e = {_finding(find)}; if (!e || ![...e.options].some(o => o.value === {choice})) return false;"
            f"e.value = {choice}; e.dispatchEvent(new Event('change', {{bubbles: true}})); return true"
        )

    def screenshot(self, path: Path) -> None:
        """Save a screenshot as PNG."""
        data = self.call("Page.captureScreenshot", format="png")["data"]
        path.write_bytes(base64.b64decode(data))

    def close(self) -> None:
        """Close the browser and all of its processes."""
        socket = getattr(self, "_socket", None)
        if socket:
            with contextlib.suppress(ConnectionClosed):  # the browser may exit before it answers
                self.call("Browser.close")
            self._stack.close()
        else:
            self._process.terminate()
        try:
            self._process.wait(30)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()

    def start(self, script: str, method: str = "Runtime.evaluate") -> None:
        """Start a script (for example one that hangs) or a method without parameters; do not wait for the answer."""
        params = {"expression": script} if script else {}
        self._socket.send(json.dumps({"id": next(self._numbers), "method": method, "params": params}))

    def processes(self) -> list[psutil.Process]:
        """Return the browser and its child processes; an empty list if it has exited."""
        with contextlib.suppress(psutil.NoSuchProcess):
            process = psutil.Process(self._process.pid)
            return [process, *process.children(recursive=True)]
        return []

    def kill(self) -> None:
        """Kill all processes of the browser, to simulate a crash."""
        for each in self.processes():
            with contextlib.suppress(psutil.NoSuchProcess):
                each.kill()
        self._process.wait(60)
        with contextlib.suppress(ConnectionClosed):
            self._stack.close()
        self._folder.cleanup()

    def _connect(self) -> contextlib.AbstractContextManager[ClientConnection]:
        file = Path(self._folder.name, "DevToolsActivePort")

        def has_started() -> bool:
            assert self._process.poll() is None, "chromium has ended"
            return file.exists() and len(file.read_text().splitlines()) == 2

        wait_until(has_started, PATIENCE, "chromium does not start")
        port, path = file.read_text().splitlines()
        with connect(
            f"ws://127.0.0.1:{port}{path}", max_size=None, compression=None, open_timeout=PATIENCE
        ) as whole:

            def tabs() -> list[str]:
                whole.send(json.dumps({"id": 1, "method": "Target.getTargets"}))
                while (answer := json.loads(whole.recv(timeout=PATIENCE))).get("id") != 1:
                    pass
                found = answer["result"]["targetInfos"]
                return [each["targetId"] for each in found if each["type"] == "page"]

            tab = wait_until(tabs, PATIENCE, "chromium opens no tab")[0]
        return connect(
            f"ws://127.0.0.1:{port}/devtools/page/{tab}",
            max_size=None,
            compression=None,
            open_timeout=PATIENCE,
        )


def _finding(find: str, text: str = "") -> str:
    """Return an expression for the first visible element that contains this text."""
    return (
        f"[...document.querySelectorAll({json.dumps(find)})].find("
        f"e => e.getClientRects().length && e.textContent.includes({json.dumps(text)}))"
    )
