"""Programs that use pins without a part on the virtual board, or forget a call: the message names the pin."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator

import pytest

from minirospy.board.model import Function
from minirospy.board.rpigpio import BCM, BOARD, IN, OUT, Gpio
from minirospy.board.wiring import wiring_fault


@pytest.fixture
def gpio() -> Iterator[Gpio]:
    gpio = Gpio()
    gpio.setmode(BCM)
    gpio.setwarnings(False)
    yield gpio
    gpio.close()


@pytest.mark.parametrize(
    ("channel", "pin", "direction", "is_board", "fault"),
    [
        (4, 4, Function.OUT, False, ""),
        (11, 11, Function.IN, False, ""),
        (21, 21, Function.IN, False, ""),
        (7, 4, Function.OUT, True, ""),
        (
            21,
            21,
            Function.OUT,
            False,
            "nothing is wired to GPIO 21: its LEDs are at 2 to 7, its buttons at 11 and 12 (BCM numbers)",
        ),
        (
            11,
            11,
            Function.OUT,
            False,
            "GPIO 11 is a button: as an output it reads no press, and on a real board a press is a short circuit",
        ),
        (
            11,
            17,
            Function.IN,
            True,
            "nothing is wired: 11 with GPIO.BOARD is GPIO 17; with GPIO.setmode(GPIO.BCM), 11 is a part of the board",
        ),
        (40, 21, Function.OUT, True, "nothing is wired to 40 with GPIO.BOARD is GPIO 21"),
    ],
)
def test_wiring(channel: int, pin: int, direction: Function, is_board: bool, fault: str) -> None:
    found = wiring_fault(channel, pin, direction, is_board=is_board)
    assert found.startswith(fault)
    assert bool(found) == bool(fault)


def test_unwired_output_is_reported_once_in_spite_of_setwarnings(gpio: Gpio) -> None:
    with pytest.warns(RuntimeWarning, match="virtual board: nothing is wired to GPIO 21"):
        gpio.setup(21, OUT)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        gpio.setup(21, OUT)
        gpio.setup(4, OUT)


@pytest.mark.skipif(sys.version_info < (3, 11), reason="Python 3.10 has no notes")
@pytest.mark.parametrize(
    ("call", "note"),
    [
        (lambda gpio: gpio.output(4, True), "channel 4: call GPIO.setup(4, GPIO.OUT) before"),
        (lambda gpio: gpio.output((5, 6), True), "channel 5: call GPIO.setup(5, GPIO.OUT) before"),
        (lambda gpio: gpio.input(11), "channel 11: call GPIO.setup(11, GPIO.IN) before"),
        (lambda gpio: gpio.add_event_detect(12, 31), "channel 12: call GPIO.setup(12, GPIO.IN) before"),
        (lambda gpio: gpio.setup(77, IN), "it is 77, with the numbers of GPIO.BCM"),
        (lambda gpio: gpio.input("4"), "it is '4'"),
    ],
)
def test_error_has_no_other_before_it_and_names_the_channel(
    call: Callable[[Gpio], object], note: str, gpio: Gpio
) -> None:
    with pytest.raises((RuntimeError, ValueError, TypeError)) as caught:
        call(gpio)
    assert caught.value.__context__ is None or caught.value.__suppress_context__
    assert caught.value.__notes__ == [f"minirospy: {note}"]


def test_numbering_is_part_of_the_report() -> None:
    gpio = Gpio()
    gpio.setmode(BOARD)
    with pytest.warns(RuntimeWarning, match=r"11 with GPIO\.BOARD is GPIO 17"):
        gpio.setup(11, IN)
    gpio.close()
