"""minirospy board: the virtual board as a picture, and its buttons and pins for scripts."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING

from minirospy.cli.command import Parser, run
from minirospy.cli.verbs import Family, Verb
from minirospy.gpio.board import Board, BoardState
from minirospy.gpio.model import BUTTONS, LEDS, Function, Pin, Pull

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderResult

__all__ = ["Picture", "main", "render"]

_PICTURES_A_SECOND = 20


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    if not words:
        return run(_FAMILY.name, _show)
    return _FAMILY.main(words)


class Picture:
    """What rich draws for a board: its lights, its buttons, and the other pins in use."""

    def __init__(self, state: BoardState) -> None:
        self.state = state

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich import box
        from rich.console import Group
        from rich.panel import Panel
        from rich.table import Table
        from rich.text import Text

        on, off = ("(*)", "( )") if options.ascii_only else ("●", "○")
        down, up = ("[*]", "[ ]") if options.ascii_only else ("▣", "□")
        lights = Table.grid(padding=(0, 2))
        lights.add_row("LEDs   ", *(f"GPIO {pin}" for pin in LEDS))
        lit = {pin: bool(self.state.level(pin)) for pin in LEDS}
        styles = {pin: f"bold bright_{LEDS[pin]}" if lit[pin] else f"dim {LEDS[pin]}" for pin in LEDS}
        lights.add_row("", *(Text(on if lit[pin] else off, style=styles[pin]) for pin in LEDS))
        buttons = Table.grid(padding=(0, 2))
        buttons.add_row("Buttons", *(f"GPIO {pin}" for pin in BUTTONS))
        pressed = [bool(self.state.level(pin)) for pin in BUTTONS]
        caps = [f"{down if is_down else up} {number}" for number, is_down in enumerate(pressed, 1)]
        looks = ["bold reverse" if is_down else "" for is_down in pressed]
        buttons.add_row("", *(Text(cap, style=look) for cap, look in zip(caps, looks, strict=True)))
        others: list[str | Text] = [
            f"GPIO {number}  {_function(pin)} {pin.level}"
            for number, pin in enumerate(self.state.pins)
            if number not in LEDS and number not in BUTTONS and pin != Pin()
        ]
        yield Panel(
            Group(lights, "", buttons, *(["", *others] if others else [])),
            title=f"virtual board [{self.state.name}]".replace("[", "\\["),
            box=box.ASCII if options.ascii_only else box.ROUNDED,
            expand=False,
        )


def render(state: BoardState) -> Picture:
    """The rich renderable of ``state``."""
    return Picture(state)


def _show() -> int:
    with Board() as board:
        if not sys.stdout.isatty():
            _print_pins(board.state())
            return 0
        from rich.console import Console, Group
        from rich.live import Live
        from rich.text import Text

        keys = " and ".join(str(number) for number in range(1, len(BUTTONS) + 1))
        hint = Text(f"keys {keys}: press or release a button; q: quit", style="dim")
        live = Live(
            get_renderable=lambda: Group(render(board.state()), hint),
            console=Console(),
            refresh_per_second=_PICTURES_A_SECOND,
        )
        with _Keys() as pressed, live:
            while (key := pressed.next()) not in {"q", "\x04"}:
                if key.isdecimal() and 1 <= int(key) <= len(BUTTONS):
                    pin = BUTTONS[int(key) - 1]
                    (board.release if board.get(pin) else board.press)(pin)
    return 0


class _Keys:
    """Single keys from the terminal, without Enter and without echo; none where stdin is no terminal."""

    def __init__(self) -> None:
        self._is_terminal = sys.stdin is not None and sys.stdin.isatty()

    def __enter__(self) -> _Keys:
        if sys.platform != "win32" and self._is_terminal:
            import termios
            import tty

            self._before = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if sys.platform != "win32" and self._is_terminal:
            import termios

            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)

    def next(self) -> str:
        """The key that was typed, or "" after a moment."""
        if not self._is_terminal:
            time.sleep(0.2)
            return ""
        if sys.platform == "win32":
            import msvcrt

            if msvcrt.kbhit():
                return msvcrt.getwch()
            time.sleep(0.05)
            return ""
        import os
        import select

        ready, _, _ = select.select([sys.stdin], [], [], 0.2)
        # Past Python's buffer: what it holds, select does not see. No byte at all is the terminal's end.
        return os.read(sys.stdin.fileno(), 1).decode("ascii", "replace") or "q" if ready else ""


def _press(argv: Sequence[str]) -> None:
    pins = _pins("press", "Push buttons; they stay pressed until `release`.", argv)
    with Board() as board:
        for pin in pins:
            board.press(pin)


def _release(argv: Sequence[str]) -> None:
    pins = _pins("release", "Let go of buttons.", argv)
    with Board() as board:
        for pin in pins:
            board.release(pin)


def _get(argv: Sequence[str]) -> None:
    pins = _pins("get", "Print the level of pins: a line with 0 or 1 for each.", argv)
    with Board() as board:
        for pin in pins:
            print(board.get(pin))


def _set(argv: Sequence[str]) -> None:
    parser = Parser(
        "minirospy board set", description="Put a level on an input from outside, or on an output."
    )
    parser.add_argument("pin", type=int, help="BCM number")
    parser.add_argument("level", type=int, choices=(0, 1))
    options = parser.parse_args(argv)
    with Board() as board:
        board.set(options.pin, options.level)


def _watch(argv: Sequence[str]) -> None:
    parser = Parser("minirospy board watch", description="Print a line `PIN LEVEL` for each edge.")
    parser.add_argument("pin", nargs="*", type=int, help="BCM numbers (all pins)")
    parser.add_argument(
        "-n", dest="count", type=int, default=0, help="end after COUNT lines", metavar="COUNT"
    )
    options = parser.parse_args(argv)
    with Board() as board:
        for number, edge in enumerate(board.watch(options.pin or None), 1):
            print(edge.pin, edge.level, flush=True)
            if number == options.count:
                break


def _list(argv: Sequence[str]) -> None:
    Parser("minirospy board list", description="Print the wired pins and those in use.").parse_args(argv)
    with Board() as board:
        _print_pins(board.state())


def _print_pins(state: BoardState) -> None:
    parts = {pin: f"{colour} LED" for pin, colour in LEDS.items()} | dict.fromkeys(BUTTONS, "button")
    print("pin level function pull part")
    for number, pin in enumerate(state.pins):
        if number in parts or pin != Pin():
            pull = Pull(pin.pull).name.lower()
            print(
                f"{number:>3} {pin.level:<5} {_function(pin):<8} {pull:<4} {parts.get(number, '')}".rstrip()
            )


def _function(pin: Pin) -> str:
    return "out" if pin.function is Function.OUT else "in"


def _pins(verb: str, description: str, argv: Sequence[str]) -> list[int]:
    parser = Parser(f"minirospy board {verb}", description=description)
    parser.add_argument("pin", nargs="+", type=int, help="BCM numbers")
    pins: list[int] = parser.parse_args(argv).pin
    return pins


_FAMILY = Family(
    "minirospy board",
    "minirospy board shows the virtual board live; with a command it serves scripts. Pins are BCM numbers.",
    (
        Verb("press", "push buttons: press 11", _press),
        Verb("release", "let go of buttons: release 11", _release),
        Verb("get", "print the level of pins: get 7", _get),
        Verb("set", "put a level on a pin: set 7 1", _set),
        Verb("watch", "print a line for each edge: watch 7", _watch),
        Verb("list", "print the pins", _list),
    ),
    "MINIROSPY_BOARD names the board (default: default).",
)
