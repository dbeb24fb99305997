"""Drive Debian's chromium in tests, through the DevTools protocol over its WebSocket: act like a user, wait for visible results.

Source: https://chromedevtools.github.io/devtools-protocol.
"""

from __future__ import annotations

import atexit
import base64
import contextlib
import functools
import itertools
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
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
    # Several tabs are in use at the same time; none of them is in the background.
    "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
)
_numbers = itertools.count(1)  # the ids of the messages to browsers

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


class Browser:
    """A running chromium. Each tab has its own profile, like a private window, and is never in the background."""

    def __init__(self, *flags: str) -> None:
        assert CHROMIUM
        self._folder = tempfile.TemporaryDirectory(prefix="chromium-", ignore_cleanup_errors=True)
        # Chromium ignores --enable-gpu after --disable-gpu.
        common = [each for each in _FLAGS if each != "--disable-gpu" or "--enable-gpu" not in flags]
        self.process = subprocess.Popen(
            [CHROMIUM, *common, *flags, f"--user-data-dir={self._folder.name}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._port = ""
        self._stack = contextlib.ExitStack()
        try:
            self._socket = self._stack.enter_context(self._connect())
        except BaseException:
            self.process.kill()
            self.process.wait()
            self._folder.cleanup()
            raise

    @property
    def is_alive(self) -> bool:
        """Return whether the browser still runs."""
        return self.process.poll() is None

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Call a protocol method of the browser; return its result."""
        answer = ask(self._socket, method, params)
        assert "error" not in answer, answer
        result: dict[str, Any] = answer["result"]
        return result

    def open_tab(self) -> tuple[str, contextlib.AbstractContextManager[ClientConnection]]:
        """Open an empty tab; return the id of its profile, and the connection to the tab."""
        context = str(self.call("Target.createBrowserContext")["browserContextId"])
        tab = self.call("Target.createTarget", url="about:blank", browserContextId=context, newWindow=True)
        return context, self._open(f"/devtools/page/{tab['targetId']}")

    def close(self) -> None:
        """Close the browser and all of its processes. Idempotent."""
        with contextlib.suppress(ConnectionClosed):  # the browser may exit before it answers
            ask(self._socket, "Browser.close", {})
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        with contextlib.suppress(ConnectionClosed):
            self._stack.close()
        self._folder.cleanup()

    def processes(self) -> list[psutil.Process]:
        """Return the browser and its child processes; an empty list if it has exited."""
        with contextlib.suppress(psutil.NoSuchProcess):
            process = psutil.Process(self.process.pid)
            return [process, *process.children(recursive=True)]
        return []

    def _connect(self) -> contextlib.AbstractContextManager[ClientConnection]:
        file = Path(self._folder.name, "DevToolsActivePort")

        def has_started() -> bool:
            assert self.is_alive, "chromium has ended"
            return file.exists() and len(file.read_text().splitlines()) == 2

        wait_until(has_started, PATIENCE, "chromium does not start")
        self._port, path = file.read_text().splitlines()
        return self._open(path)

    def _open(self, path: str) -> contextlib.AbstractContextManager[ClientConnection]:
        return connect(
            f"ws://127.0.0.1:{self._port}{path}",
            max_size=None,
            compression=None,
            open_timeout=PATIENCE,
            ping_interval=None,  # a busy machine may answer late
        )


@functools.cache
def _shared() -> list[Browser]:
    """Return a list of at most one browser, which serves all tabs of this process that need none of their own."""
    shared: list[Browser] = []
    atexit.register(close_shared_browser)
    return shared


def shared_browser() -> Browser:
    """Return the browser of this process; start one if none runs. Starting one takes more than a second of CPU."""
    shared = _shared()
    if shared and not shared[0].is_alive:
        close_shared_browser()
    if not shared:
        shared.append(Browser())
    return shared[0]


def close_shared_browser() -> None:
    """Close the browser of this process, if any."""
    shared = _shared()
    while shared:
        shared.pop().close()


class Page:
    """A browser tab. ``script`` is JavaScript; ``find`` is a CSS selector.

    ``own_browser``, or ``flags`` of chromium: start a browser for this tab alone.
    """

    def __init__(
        self,
        url: str,
        *,
        width: int = 1200,
        height: int = 760,
        dark: bool = False,
        flags: tuple[str, ...] = (),
        own_browser: bool = False,
    ) -> None:
        self._own = Browser(*flags) if flags or own_browser else None
        self._browser = self._own or shared_browser()
        self.errors: list[str] = []
        """Errors that the page logged: exceptions, and violations of its Content-Security-Policy."""
        self._stack = contextlib.ExitStack()
        self._stack.callback(self._close_profile)
        self._context = ""
        try:
            self._context, connection = self._browser.open_tab()
            self._socket = self._stack.enter_context(connection)
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
            # Otherwise, only one of several tabs has the focus.
            self.call("Emulation.setFocusEmulationEnabled", enabled=True)
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
        return ask(self._socket, method, params, self._event)

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

    def save_downloads(self, folder: Path) -> None:
        """Save the files that this tab downloads into a folder."""
        self._browser.call(
            "Browser.setDownloadBehavior",
            behavior="allow",
            downloadPath=str(folder),
            browserContextId=self._context,
        )

    def close(self) -> None:
        """Close the tab and its profile, and the browser if it is the tab's own."""
        with contextlib.suppress(ConnectionClosed):
            self._stack.close()

    def _close_profile(self) -> None:
        if self._own:
            self._own.close()
        elif self._context and self._browser.is_alive:
            self._browser.call("Target.disposeBrowserContext", browserContextId=self._context)

    def start(self, script: str, method: str = "Runtime.evaluate") -> None:
        """Start a script (for example one that hangs) or a method without parameters; do not wait for the answer."""
        params = {"expression": script} if script else {}
        self._socket.send(json.dumps({"id": next(_numbers), "method": method, "params": params}))

    def processes(self) -> list[psutil.Process]:
        """Return the processes of the tab's own browser; an empty list if it has exited."""
        assert self._own, "other tabs use this browser, too: pass own_browser"
        return self._own.processes()

    def kill(self) -> None:
        """Kill all processes of the tab's own browser, to simulate a crash."""
        for each in self.processes():
            with contextlib.suppress(psutil.NoSuchProcess):
                each.kill()
        self.close()


def ask(
    socket: ClientConnection,
    method: str,
    params: dict[str, Any],
    on_event: Callable[[dict[str, Any]], object] = lambda _: None,
) -> dict[str, Any]:
    """Call a protocol method; return the answer, with its "result" or "error". Pass earlier events to ``on_event``."""
    number = next(_numbers)
    socket.send(json.dumps({"id": number, "method": method, "params": params}))
    while True:
        answer: dict[str, Any] = json.loads(socket.recv(timeout=PATIENCE * 2))
        if answer.get("id") == number:
            return answer
        if "method" in answer:
            on_event(answer)


def _finding(find: str, text: str = "") -> str:
    """Return an expression for the first visible element that contains this text."""
    return (
        f"[...document.querySelectorAll({json.dumps(find)})].find("
        f"e => e.getClientRects().length && e.textContent.includes({json.dumps(text)}))"
    )
