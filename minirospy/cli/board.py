"""`minirospy board`: draws the virtual board. Its verbs control the buttons, the pins and the simulated person."""

from __future__ import annotations

import contextlib
import math
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import UsageError
from minirospy.base.escape import own_output
from minirospy.base.keyboard import Keys
from minirospy.board.board import Board, BoardState
from minirospy.board.directory import BoardDirectory
from minirospy.board.model import BUTTONS, LEDS, Function, Pin, Position, Pull
from minirospy.board.scanner import FIELDS, Circle
from minirospy.command.command import run, warn
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Family, Verb

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
    from rich.text import Text

__all__ = ["FAMILY", "Picture", "main", "render"]

_STEP = 0.05
"""Distance that the person moves per key press, in metres. A cell of the map is as wide as this, and twice as high."""

_MAP_AHEAD, _MAP_ASIDE = 0.8, 0.6  # range of the map in metres, ahead of the scanner and to each side

_START: Position = (0.6, 0.0)  # initial position of the person in front of the scanner

_STEPS = {"up": (_STEP, 0.0), "down": (-_STEP, 0.0), "left": (0.0, _STEP), "right": (0.0, -_STEP)}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    if words[:1] in (["-b"], ["--board"]):
        if len(words) == 1:
            return run(FAMILY.name, _missing_name)
        # Set this variable for the nodes, so that they open the same board as this command.
        os.environ["MINIROSPY_BOARD"] = words[1]
        words = words[2:]
    if not words:
        return run(FAMILY.name, _show)
    return FAMILY.main(words)


def _missing_name() -> int:
    raise UsageError("-b needs the name of a board: minirospy board -b robot1")


class Picture:
    """A rich renderable that draws a board: its LEDs, its buttons, the person at the scanner, and other pins in use."""

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
        person: list[str | Text] = []
        if self.state.person:
            person = [
                "",
                f"Person   {_where(self.state.person)}",
                *_map(self.state.person, options.ascii_only),
            ]
        yield Panel(
            Group(lights, "", buttons, *person, *(["", *others] if others else [])),
            title=f"virtual board [{self.state.name}]".replace("[", "\\["),
            box=box.ASCII if options.ascii_only else box.ROUNDED,
            expand=False,
        )


def _map(person: Position, ascii_only: bool) -> list[Text]:
    """Return a top view of the floor in front of the scanner, with the scanner's two fields and the person."""
    from rich.text import Text

    body = Circle(*person)
    warning, protective, somebody, scanner = ("-", "=", "#", "^") if ascii_only else ("░", "▒", "█", "▲")
    colour = {warning: "yellow", protective: "red", somebody: "bold bright_white", scanner: "bold"}
    lines = []
    for row in range(round(_MAP_AHEAD / _STEP / 2), -1, -1):
        line = Text("         ")
        for column in range(round(_MAP_ASIDE / _STEP), -round(_MAP_ASIDE / _STEP) - 1, -1):
            x, y = 2 * row * _STEP, column * _STEP
            away = math.hypot(x, y)
            place = " "
            if math.hypot(x - body.x, y - body.y) <= body.radius:
                place = somebody
            elif not row and not column:
                place = scanner
            elif away < FIELDS[1]:
                place = protective
            elif away < FIELDS[0]:
                place = warning
            line.append(place, colour.get(place, ""))
        lines.append(line)
    return lines


def _where(person: Position) -> str:
    ahead, left = person
    side = "left" if left >= 0 else "right"
    return f"{ahead:.2f} m ahead, {abs(left):.2f} m {side}; nearest {Circle(*person).distance:.2f} m"


def render(state: BoardState) -> Picture:
    """Return a rich renderable that draws ``state``."""
    return Picture(state)


def _show() -> int:
    with Board() as board:
        if not sys.stdout.isatty():
            _print_pins(board.state())
            return 0
        from rich.console import Console, Group
        from rich.text import Text

        keys = " and ".join(str(number) for number in range(1, len(BUTTONS) + 1))
        hint = Text(
            f"keys {keys}: press or release a button; arrows: move the person before the scanner, "
            "p: send them away; q: quit",
            style="dim",
        )
        shown = None
        with Keys() as pressed, _drawing(Console(file=own_output())) as draw:
            key = ""
            while key not in {"q", "\x04"}:
                _act(board, key)
                if (state := board.state()) != shown:
                    shown = state
                    draw(Group(render(shown), hint))
                key = pressed.next()
    return 0


@contextlib.contextmanager
def _drawing(console: Console) -> Iterator[Callable[[RenderableType], None]]:
    """Yield a function that draws over the previous drawing, or below it on a dumb terminal, which cannot move its cursor up."""
    from rich.live import Live

    if console.is_dumb_terminal:
        yield console.print
        return
    with Live(console=console, auto_refresh=False) as live:
        yield lambda drawn: live.update(drawn, refresh=True)


def _act(board: Board, key: str) -> None:
    """Perform the action bound to a key on the board."""
    if key.isdecimal() and 1 <= int(key) <= len(BUTTONS):
        pin = BUTTONS[int(key) - 1]
        (board.release if board.get(pin) else board.press)(pin)
    elif key == "p":
        board.move_person(None if board.person else _START)
    elif key in _STEPS:
        person = board.person
        ahead, left = _STEPS[key]
        board.move_person((round(person[0] + ahead, 3), round(person[1] + left, 3)) if person else _START)


def _pins_parser(verb: str, description: str) -> Parser:
    parser = Parser(f"minirospy board {verb}", description)
    parser.add_argument("pin", nargs="+", type=int, help="BCM numbers", completer="pins")
    return parser


def _press_parser() -> Parser:
    return _pins_parser("press", "Push buttons; they stay pressed until `release`.")


def _press(pin: Sequence[int]) -> None:
    with Board() as board:
        for each in pin:
            board.press(each)
            used = board.state().pins[each]
            # Do not warn about an input with a pull resistor: the user may have connected a button.
            if each not in BUTTONS and (used.function is Function.OUT or used.pull == Pull.OFF):
                part = f"it is wired to a {LEDS[each]} LED" if each in LEDS else "nothing is wired to it"
                warn(
                    f"GPIO {each} has no button, {part}: the buttons are GPIO {' and '.join(map(str, BUTTONS))}"
                )


def _release_parser() -> Parser:
    return _pins_parser("release", "Release buttons.")


def _release(pin: Sequence[int]) -> None:
    with Board() as board:
        for each in pin:
            board.release(each)


def _get_parser() -> Parser:
    return _pins_parser("get", "Print the level of pins: a line with 0 or 1 for each.")


def _get(pin: Sequence[int]) -> None:
    with Board() as board:
        for each in pin:
            print(board.get(each))


def _set_parser() -> Parser:
    parser = Parser("minirospy board set", "Put a level on an input from outside, or on an output.")
    parser.add_argument("pin", type=int, help="BCM number", completer="pins")
    parser.add_argument("level", type=int, choices=(0, 1))
    return parser


def _set(pin: int, level: int) -> None:
    with Board() as board:
        board.set(pin, level)


def _person_parser() -> Parser:
    parser = Parser(
        "minirospy board person",
        "Put a person before the simulated scanner, or send them away; alone: print where they are.",
    )
    parser.add_argument(
        "ahead", nargs="?", help="metres ahead of the scanner, or `away`", completer="nothing"
    )
    parser.add_argument("left", nargs="?", help="metres to its left (0)", completer="nothing")
    return parser


def _person(ahead: str | None, left: str | None) -> None:
    with Board() as board:
        if ahead == "away" and left is None:
            board.move_person(None)
        elif ahead is not None:
            try:
                position = float(ahead), float(left or 0)
            except ValueError:
                raise Misuse(
                    "metres are numbers: minirospy board person 0.3 0; or: minirospy board person away"
                ) from None
            board.move_person(position)
        else:
            print(_where(board.person) if board.person else "away")


def _boards_parser() -> Parser:
    return Parser("minirospy board boards", "Print the names of the boards of this user.")


def _boards() -> None:
    for name in BoardDirectory.find().names():
        print(name)


def _watch_parser() -> Parser:
    parser = Parser("minirospy board watch", "Print a line `PIN LEVEL` for each edge.")
    parser.add_argument("pin", nargs="*", type=int, help="BCM numbers (all pins)", completer="pins")
    parser.add_argument(
        "-n", dest="count", type=int, default=0, help="exit after COUNT lines", metavar="COUNT"
    )
    return parser


def _watch(pin: Sequence[int], count: int) -> None:
    with Board() as board:
        for number, edge in enumerate(board.watch(pin or None), 1):
            print(edge.pin, edge.level, flush=True)
            if number == count:
                break


def _reset_parser() -> Parser:
    return Parser(
        "minirospy board reset", "Make all pins inputs at 0, release all buttons, send the person away."
    )


def _reset() -> None:
    with Board() as board:
        board.reset()


def _list_parser() -> Parser:
    return Parser("minirospy board list", "Print the wired pins and those in use.")


def _list() -> None:
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


FAMILY = Family(
    "minirospy board",
    "minirospy board shows the virtual board live; with a command it serves scripts. Pins are BCM numbers.",
    (
        Verb("person", "put a person before the scanner: person 0.3 0, person away", _person_parser, _person),
        Verb("press", "push buttons: press 11", _press_parser, _press),
        Verb("release", "let go of buttons: release 11", _release_parser, _release),
        Verb("get", "print the level of pins: get 7", _get_parser, _get),
        Verb("set", "put a level on a pin: set 7 1", _set_parser, _set),
        Verb("watch", "print a line for each edge: watch 7", _watch_parser, _watch),
        Verb("list", "print the pins", _list_parser, _list),
        Verb("reset", "make the board as new", _reset_parser, _reset),
        Verb("boards", "print the names of the boards", _boards_parser, _boards),
    ),
    "Several boards, one for each robot: `minirospy board -b NAME ...`, and MINIROSPY_BOARD=NAME for its nodes.",
)
