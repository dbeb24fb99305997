"""`minirospy demo`: the workshop's button lights its LED, on the virtual board, from one command."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from minirospy.base.child_lifetime import guard_children
from minirospy.base.errors import MinirospyError
from minirospy.base.escape import own_output
from minirospy.board.board import Board
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command

if TYPE_CHECKING:
    from rich.console import Group

__all__ = ["COMMAND", "main"]

BUTTON, LED = 11, 7
_HOLD_SECONDS, _REST_SECONDS = 0.85, 0.65
"""Seconds for which the button is held, and then left released.

Neither is a multiple of the node's polling period of 0.1 s, so that the LED reacts after its typical delay.
"""
_FOLLOW_SECONDS = 10.0
_START_SECONDS = 180.0
"""Timeout in seconds: enough for a Raspberry Pi, or for Windows with a virus scanner. A failed launch ends the wait."""
_WAY = (
    "button_publisher.py --- /button_state (std_msgs/Bool) ---> led_actuator.py",
    "  reads GPIO 11, ten times a second                          sets GPIO 7",
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 0 if the LED followed the button each time, else 1."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser("minirospy demo", (__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--presses", type=int, metavar="N", help="end after N presses (default: 3, on a terminal at Ctrl-C)"
    )
    return parser


def _demo(presses: int | None) -> int:
    if presses is not None and presses < 1:
        raise Misuse("--presses takes a number from 1")
    if presses is None and not sys.stdout.isatty():
        presses = 3

    with (
        guard_children(),
        _exit_on_signals(),
        _own_world() as folder,
        _launched(folder / "roslaunch.log") as launch,
        Board() as board,
    ):
        _wait_until_ready(board, launch, folder / "roslaunch.log")
        show = _Picture(board) if sys.stdout.isatty() and not _is_dumb() else _Lines()
        failures = 0
        with contextlib.suppress(KeyboardInterrupt), show:
            count = 0
            while presses is None or count < presses:
                count += 1
                for level in (1, 0):
                    took = _follow(board, level)
                    failures += took is None
                    show.tell(count, level, took)
                    _rest(launch, show, _HOLD_SECONDS if level else _REST_SECONDS)
        if failures:
            print(f"GPIO {LED} did not follow GPIO {BUTTON} {failures} times", file=sys.stderr)
        return 1 if failures else 0


def _is_dumb() -> bool:
    """Return whether stdout is a terminal that cannot move the cursor back, such as the one in an editor."""
    from rich.console import Console

    return Console().is_dumb_terminal


@contextlib.contextmanager
def _exit_on_signals() -> Iterator[None]:
    """Raise SystemExit on SIGTERM, and on SIGHUP except under nohup, so that ``finally`` blocks stop roslaunch.

    Further signals do not interrupt them.
    """

    def leave(number: int, _: FrameType | None) -> None:
        for each in before:
            signal.signal(each, signal.SIG_IGN)
        raise SystemExit(128 + number)

    found = (getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP"))
    before = {
        number: signal.getsignal(number)
        for number in found
        if number is not None and signal.getsignal(number) != signal.SIG_IGN
    }
    for number in before:
        signal.signal(number, leave)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def _own_world() -> Iterator[Path]:
    """Set up a separate master port and board, so that the demo does not affect other programs. Yield a temporary folder."""
    with tempfile.TemporaryDirectory(prefix="minirospy-demo-", ignore_cleanup_errors=True) as folder:
        os.environ["MINIROSPY_LOCAL"] = "1"
        os.environ["ROS_MASTER_URI"] = f"http://localhost:{_free_port()}"
        os.environ["ROS_LOG_DIR"] = folder
        if not os.environ.get("MINIROSPY_BOARD"):
            os.environ["MINIROSPY_BOARD"] = f"demo-{os.getpid()}"
            os.environ["MINIROSPY_BOARD_TEMPORARY"] = "1"
        yield Path(folder)


def _free_port() -> int:
    """Return a free port for the master, which starts later.

    The system must not choose the port, because it returns an ephemeral port (32768 or 49152 and up), which another
    program's connection may use before the master starts.
    """
    for port in random.sample(range(20_000, 32_000), 100):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port
    raise MinirospyError("the demo's master finds no free port from 20000 to 32000")


@contextlib.contextmanager
def _launched(log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run roslaunch with the workshop's launch file. On exit, stop roslaunch and its nodes with SIGINT."""
    command = [
        sys.executable,
        "-m",
        "minirospy.ros.roslaunch.commands.roslaunch",
        "rpi_feros_bringup",
        "rpi_led.launch",
    ]
    windows = sys.platform == "win32"
    flags = subprocess.CREATE_NEW_PROCESS_GROUP if windows else 0  # type: ignore[attr-defined,unused-ignore]

    with log.open("wb") as output:
        launch = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=not windows,
            creationflags=flags,
        )
    try:
        yield launch
    finally:
        stop = signal.CTRL_BREAK_EVENT if windows else signal.SIGINT  # type: ignore[attr-defined,unused-ignore]
        with contextlib.suppress(OSError):
            launch.send_signal(stop)
        try:
            launch.wait(10.0)
        except subprocess.TimeoutExpired:
            launch.kill()
            launch.wait()


def _wait_until_ready(board: Board, launch: subprocess.Popen[bytes], log: Path) -> None:
    """Press the button until the LED lights up, which shows that both nodes are connected.

    Raise MinirospyError if that takes too long.
    """
    print("Starting the master, button_publisher.py and led_actuator.py ...", flush=True)
    end = time.monotonic() + _START_SECONDS
    while time.monotonic() < end:
        if launch.poll() is not None:
            break
        board.press(BUTTON)
        if _wait_for(board, 1, 0.3) is not None:
            board.release(BUTTON)
            _wait_for(board, 0, _FOLLOW_SECONDS)
            return
    said = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-8:]
    raise MinirospyError("the nodes did not start; roslaunch said:\n  " + "\n  ".join(said))


def _follow(board: Board, level: int) -> float | None:
    """Press or release the button. Return the seconds until the LED followed, or None if it did not follow."""
    start = time.monotonic()
    (board.press if level else board.release)(BUTTON)
    return None if _wait_for(board, level, _FOLLOW_SECONDS) is None else time.monotonic() - start


def _wait_for(board: Board, level: int, timeout: float) -> int | None:
    """Wait until the LED's level is ``level`` and return it, or return None after ``timeout`` seconds."""
    watch = board.watch([LED], timeout=timeout)
    if board.get(LED) == level:
        return level
    for edge in watch:
        if edge.level == level:
            return level
    return None


def _rest(launch: subprocess.Popen[bytes], show: _Lines | _Picture, seconds: float) -> None:
    end = time.monotonic() + seconds
    while (rest := end - time.monotonic()) > 0:
        if launch.poll() is not None:
            raise MinirospyError("roslaunch has ended")
        show.refresh()
        time.sleep(min(rest, 0.05))


class _Lines:
    """Prints one line per key press, for output that is not a terminal or cannot be redrawn."""

    def __enter__(self) -> None:
        print("\n".join(_WAY), flush=True)

    def __exit__(self, *_: object) -> None:
        pass

    def tell(self, count: int, level: int, took: float | None) -> None:
        verb = "pressed " if level else "released"
        result = (
            f"LED on GPIO {LED} {'on' if level else 'off'} after {1000 * took:.0f} ms" if took else "nothing"
        )
        print(f"{count}: button 1 {verb} -> {result}", flush=True)

    def refresh(self) -> None:
        pass


class _Picture:
    """Shows the demo on a terminal: a picture of the board, and the current step."""

    def __init__(self, board: Board) -> None:
        from rich.console import Console
        from rich.live import Live

        self._board = board
        self._caption = ""
        self._live = Live(console=Console(file=own_output()), auto_refresh=False)

    def __enter__(self) -> None:
        self._live.__enter__()
        self.refresh()

    def __exit__(self, *details: object) -> None:
        self._live.__exit__(None, None, None)
        print("The master and both nodes end ...", flush=True)

    def tell(self, count: int, level: int, took: float | None) -> None:
        verb, state = ("pressed", "on") if level else ("released", "off")
        result = f"LED 7 {state} after {1000 * took:.0f} ms" if took else "LED 7 did not follow"
        self._caption = f"press {count}: button 1 {verb}, {result}"
        self.refresh()

    def refresh(self) -> None:
        self._live.update(self._drawn(), refresh=True)

    def _drawn(self) -> Group:
        from rich.console import Group
        from rich.text import Text

        from minirospy.cli.board import render

        words = [Text(line, style="dim") for line in _WAY]
        return Group(
            render(self._board.state()),
            *words,
            Text(self._caption, style="bold"),
            Text("Ctrl-C ends it.", style="dim"),
        )


COMMAND = Command("minirospy demo", _parser, _demo)
