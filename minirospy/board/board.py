"""The virtual board, for programs that simulate its surroundings: press buttons, read LEDs, move a person.

::

    with Board() as board:
        board.press(11)
        for edge in board.watch([7], timeout=1.0):
            print(edge.pin, edge.level)
"""

from __future__ import annotations

import queue
import threading
import time
import weakref
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from types import TracebackType

from minirospy.base.errors import BoardError
from minirospy.board.directory import BoardDirectory
from minirospy.board.link import Edge, Link
from minirospy.board.model import PINS, BoardModel, Force, Function, Pin, Position, Press, Release, Setup
from minirospy.board.protocol import MovePerson

__all__ = ["Board", "BoardState", "Edge"]


@dataclass(frozen=True)
class BoardState:
    """A snapshot of the board.

    ``pins[n]`` is BCM pin n (function, pull, level, ...); ``person`` is the position in metres ahead of the scanner and to its
    left, or None if there is no person.
    """

    name: str
    pins: tuple[Pin, ...]
    person: Position | None = None

    def level(self, pin: int) -> int:
        """Return the level at ``pin``: 0 or 1."""
        return self.pins[pin].level


class Board:
    """The board ``name`` (default: MINIROSPY_BOARD, else "default"). Starts the board's server if it is not running.

    Thread-safe. Pins are BCM numbers, 0 to 53. Every method raises BoardError if a pin does not exist or the board does
    not respond.
    """

    def __init__(self, name: str | None = None) -> None:
        directory = BoardDirectory.find(name)
        # Use weak references, so that no further edges are collected for an abandoned watch.
        self._watchers: weakref.WeakSet[queue.SimpleQueue[Edge]] = weakref.WeakSet()
        self._lock = threading.Lock()
        self.name = directory.name
        self._link = Link(directory, self._spread)

    def __enter__(self) -> Board:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def press(self, pin: int) -> None:
        """Press the button at ``pin``, until :meth:`release`.

        The pins of the wired buttons (11, 12) then read 1. Any other pin reads 1 too, unless its pull-up is enabled:
        then the button connects the pin to ground, and the pin reads 0.
        """
        self._link.call(Press(pin))

    def release(self, pin: int) -> None:
        """Release the button at ``pin``. On an input, this also undoes :meth:`set`."""
        self._link.call(Release(pin))

    def set(self, pin: int, level: int) -> None:
        """From outside of the program, drive an input to ``level`` (0 or 1) or set an output."""
        self._link.call(Force(pin, level))

    @property
    def person(self) -> Position | None:
        """The person's position in front of the scanner, in metres ahead and to the left, or None if there is no person."""
        return self._link.person

    def move_person(self, position: Position | None) -> None:
        """Place the person at a position (see :attr:`person`), or remove them (None)."""
        self._link.call(MovePerson(position))

    def reset(self) -> None:
        """Reset the board: make every pin an input at level 0, release every button, and remove the person."""
        for pin, (state, fresh) in enumerate(zip(self.state().pins, BoardModel().pins, strict=True)):
            if state != fresh:
                self._link.call(Setup(pin, Function.IN, initial=0))
                self._link.call(Release(pin))
        self.move_person(None)

    def get(self, pin: int) -> int:
        """Return the level at ``pin``: 0 or 1."""
        return self._link.levels[_checked(pin)]

    def levels(self) -> dict[int, int]:
        """Return a dict from BCM pin to level, for all pins."""
        return dict(enumerate(self._link.levels))

    def state(self) -> BoardState:
        """Return a snapshot of the board."""
        return BoardState(self.name, tuple(self._link.states), self._link.person)

    def watch(self, pins: Iterable[int] | None = None, timeout: float | None = None) -> Iterator[Edge]:
        """Yield the edges on ``pins`` (default: all) that occur after this call.

        Stops after ``timeout`` seconds in total (None: never).
        """
        chosen = None if pins is None else frozenset(_checked(pin) for pin in pins)
        arrived: queue.SimpleQueue[Edge] = queue.SimpleQueue()
        with self._lock:
            self._watchers.add(arrived)
        deadline = None if timeout is None else time.monotonic() + timeout
        return self._edges(arrived, chosen, deadline)

    def close(self) -> None:
        """Disconnect; the pins do not change. Idempotent."""
        self._link.close()

    def _edges(
        self, arrived: queue.SimpleQueue[Edge], chosen: frozenset[int] | None, deadline: float | None
    ) -> Iterator[Edge]:
        try:
            while True:
                left = None if deadline is None else max(0.0, deadline - time.monotonic())
                try:
                    edge = arrived.get(timeout=left)
                except queue.Empty:
                    return
                if chosen is None or edge.pin in chosen:
                    yield edge
        finally:
            with self._lock:
                self._watchers.discard(arrived)

    def _spread(self, edge: Edge) -> None:
        with self._lock:
            for watcher in self._watchers:
                watcher.put(edge)


def _checked(pin: int) -> int:
    if not (isinstance(pin, int) and 0 <= pin < PINS):
        raise BoardError(f"pin {pin!r} does not exist: BCM numbers are 0 to {PINS - 1}")
    return pin
