"""RPi.GPIO's API on the virtual board: its behaviour, and its exact error messages."""

from __future__ import annotations

import gc
import itertools
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from types import FrameType

import pytest

from minirospy.base.signal_dispatch import dispatching_signal
from minirospy.board import rpigpio as GPIO  # noqa: N812 - as users know it
from minirospy.board.board import Board
from minirospy.board.model import Function, Setup
from minirospy.board.rpigpio import Gpio
from minirospy.board.wave import Wave


@pytest.fixture
def gpio() -> Iterator[Gpio]:
    gpio = Gpio()
    yield gpio
    gpio.close()


@pytest.fixture
def bcm(gpio: Gpio) -> Gpio:
    gpio.setmode(GPIO.BCM)
    return gpio


@pytest.fixture
def board() -> Iterator[Board]:
    with Board() as board:
        yield board


def test_constants() -> None:
    assert (GPIO.LOW, GPIO.HIGH, GPIO.OUT, GPIO.IN, GPIO.BOARD, GPIO.BCM) == (0, 1, 0, 1, 10, 11)
    assert (GPIO.PUD_OFF, GPIO.PUD_DOWN, GPIO.PUD_UP) == (20, 21, 22)
    assert (GPIO.RISING, GPIO.FALLING, GPIO.BOTH) == (31, 32, 33)
    assert (GPIO.SERIAL, GPIO.SPI, GPIO.I2C, GPIO.HARD_PWM, GPIO.UNKNOWN) == (40, 41, 42, 43, -1)


def test_import_by_its_real_name() -> None:
    import RPi.GPIO

    assert RPi.GPIO.BCM == 11
    assert RPi.GPIO.setup == GPIO.setup
    names: dict[str, object] = {}
    exec("from RPi._GPIO import *", names)
    assert names["output"] == GPIO.output
    with pytest.raises(ImportError, match=r"^cannot import name 'PUD_SIDEWAYS' from 'RPi._GPIO'"):
        exec("from RPi._GPIO import PUD_SIDEWAYS")


MODE = "Please set pin numbering mode using GPIO.setmode(GPIO.BOARD) or GPIO.setmode(GPIO.BCM)"
INVALID = "The channel sent is invalid on a Raspberry Pi"
LIST = "Channel must be an integer or list/tuple of integers"
NO_INTEGER = "'{}' object cannot be interpreted as an integer"
PUD = "Invalid value for pull_up_down - should be either PUD_OFF, PUD_UP or PUD_DOWN"


@pytest.mark.parametrize(
    "call",
    [
        lambda gpio: gpio.setup(7, GPIO.OUT),
        lambda gpio: gpio.output(7, 1),
        lambda gpio: gpio.input(7),
        lambda gpio: gpio.gpio_function(7),
        lambda gpio: gpio.cleanup(7),
        lambda gpio: gpio.add_event_detect(7, GPIO.BOTH),
        lambda gpio: gpio.event_detected(7),
        lambda gpio: gpio.remove_event_detect(7),
        lambda gpio: gpio.wait_for_edge(7, GPIO.BOTH),
    ],
)
def test_nothing_goes_before_setmode(gpio: Gpio, call: Callable[[Gpio], object]) -> None:
    with pytest.raises(RuntimeError) as caught:
        call(gpio)
    assert str(caught.value) == MODE


def _prepare(gpio: Gpio) -> None:
    gpio.setup(11, GPIO.IN)
    gpio.setup((6, 7), GPIO.OUT)


REFUSALS: list[tuple[Callable[[Gpio], object], type[Exception], str]] = [
    (lambda g: g.setmode(GPIO.BOARD), ValueError, "A different mode has already been set!"),
    (lambda g: g.setup(54, GPIO.IN), ValueError, INVALID),
    (lambda g: g.setup(-1, GPIO.IN), ValueError, INVALID),
    (lambda g: g.setup("7", GPIO.IN), ValueError, LIST),
    (lambda g: g.setup([7, "8"], GPIO.IN), ValueError, "Channel must be an integer"),
    (lambda g: g.setup(7, GPIO.IN, pull_up_down="up"), TypeError, NO_INTEGER.format("str")),
    (lambda g: g.setup(7, GPIO.OUT, initial=None), TypeError, NO_INTEGER.format("NoneType")),
    (lambda g: g.setmode("BCM"), TypeError, NO_INTEGER.format("str")),
    (lambda g: g.setup(7, 5), ValueError, "An invalid direction was passed to setup()"),
    (
        lambda g: g.setup(7, GPIO.OUT, pull_up_down=GPIO.PUD_UP),
        ValueError,
        "pull_up_down parameter is not valid for outputs",
    ),
    (
        lambda g: g.setup(7, GPIO.IN, initial=1),
        ValueError,
        "initial parameter is not valid for inputs",
    ),
    (lambda g: g.setup(7, GPIO.IN, pull_up_down=1), ValueError, PUD),
    (lambda g: g.output(11, 1), RuntimeError, "The GPIO channel has not been set up as an OUTPUT"),
    (lambda g: g.output(20, 1), RuntimeError, "The GPIO channel has not been set up as an OUTPUT"),
    (lambda g: g.output((6, 7), (1, 0, 1)), RuntimeError, "Number of channels != number of values"),
    (lambda g: g.output(7, [1]), RuntimeError, "Number of channels != number of values"),
    (lambda g: g.output((6, 7), (1, "on")), ValueError, "Value must be an integer or boolean"),
    (lambda g: g.output(99, 1), ValueError, INVALID),
    (
        lambda g: g.output(7, "on"),
        ValueError,
        "Value must be an integer/boolean or a list/tuple of integers/booleans",
    ),
    (lambda g: g.input(20), RuntimeError, "You must setup() the GPIO channel first"),
    (lambda g: g.input(99), ValueError, INVALID),
    (
        lambda g: g.add_event_detect(7, GPIO.RISING),
        RuntimeError,
        "You must setup() the GPIO channel as an input first",
    ),
    (
        lambda g: g.add_event_detect(11, 5),
        ValueError,
        "The edge must be set to RISING, FALLING or BOTH",
    ),
    (
        lambda g: g.add_event_detect(11, GPIO.RISING, bouncetime=0),
        ValueError,
        "Bouncetime must be greater than 0",
    ),
    (
        # bouncetime is in milliseconds; this value would only make sense in seconds.
        lambda g: g.add_event_detect(11, GPIO.RISING, bouncetime=0.2),
        TypeError,
        NO_INTEGER.format("float"),
    ),
    (lambda g: g.wait_for_edge(11, GPIO.RISING, timeout=0.5), TypeError, NO_INTEGER.format("float")),
    (lambda g: g.add_event_detect(11, GPIO.RISING, callback=5), TypeError, "Parameter must be callable"),
    (lambda g: g.add_event_callback(11, 5), TypeError, "Parameter must be callable"),
    (
        lambda g: g.add_event_callback(11, print),
        RuntimeError,
        "Add event detection using add_event_detect first before adding a callback",
    ),
    (
        lambda g: g.wait_for_edge(11, GPIO.RISING, timeout=0),
        ValueError,
        "Timeout must be greater than 0",
    ),
    (
        lambda g: g.output_pin(11),
        RuntimeError,
        "You must setup() the GPIO channel as an output first",
    ),
]


def test_refusals_have_the_words_of_the_original(gpio: Gpio) -> None:
    # Not a test for each call: each would start a board.
    for call, error, text in REFUSALS:
        gpio.setmode(GPIO.BCM)
        _prepare(gpio)
        with pytest.raises(error) as caught:
            call(gpio)
        assert str(caught.value) == text
        gpio.cleanup()


def test_invalid_mode(gpio: Gpio) -> None:
    with pytest.raises(ValueError, match=r"^An invalid mode was passed to setmode\(\)$"):
        gpio.setmode(5)
    assert gpio.getmode() is None


def test_output_is_read_back_immediately_and_arrives_in_order(bcm: Gpio, board: Board) -> None:
    bcm.setup(7, GPIO.OUT)
    edges = board.watch([7], timeout=30)
    levels = [number % 2 for number in range(1, 200)]
    for level in levels:
        bcm.output(7, level)
        assert bcm.input(7) == level
    assert [next(edges).level for _ in levels] == levels
    assert heard(board, 7) == 1


def test_lists_of_channels(bcm: Gpio) -> None:
    bcm.setup([2, 3, 4], GPIO.OUT, initial=GPIO.HIGH)
    assert [bcm.input(pin) for pin in (2, 3, 4)] == [1, 1, 1]
    bcm.output((2, 3, 4), (False, True, False))
    assert [bcm.input(pin) for pin in (2, 3, 4)] == [0, 1, 0]
    bcm.output([2, 3, 4], True)
    assert [bcm.input(pin) for pin in (2, 3, 4)] == [1, 1, 1]


def test_board_numbering(gpio: Gpio, board: Board) -> None:
    gpio.setmode(GPIO.BOARD)
    gpio.setup(26, GPIO.OUT, initial=1)  # BCM 7
    assert heard(board, 7) == 1
    for power in (1, 2, 6, 27, 41):
        with pytest.raises(ValueError, match=INVALID):
            gpio.setup(power, GPIO.IN)


def test_pull_up(bcm: Gpio) -> None:
    bcm.setup(20, GPIO.IN, pull_up_down=GPIO.PUD_UP)
    assert bcm.input(20) == 1


def test_warning_about_a_pin_that_another_program_uses(bcm: Gpio) -> None:
    other = Gpio()
    other.setmode(GPIO.BCM)
    other.setup(7, GPIO.OUT)
    with pytest.warns(RuntimeWarning) as caught:
        bcm.setup(7, GPIO.OUT)
    assert str(caught[0].message) == (
        "This channel is already in use, continuing anyway.  Use GPIO.setwarnings(False) to disable warnings."
    )
    assert caught[0].filename == __file__
    bcm.cleanup()
    bcm.setmode(GPIO.BCM)
    other.output(7, 1)
    other.setup(7, GPIO.OUT)
    bcm.setwarnings(False)
    bcm.setup(7, GPIO.OUT)
    other.close()


def test_warning_about_the_pull_up_of_i2c(bcm: Gpio) -> None:
    with pytest.warns(RuntimeWarning, match=r"^A physical pull up resistor is fitted on this channel!$"):
        bcm.setup(3, GPIO.IN, pull_up_down=GPIO.PUD_UP)


def test_cleanup(bcm: Gpio, board: Board) -> None:
    bcm.setup([6, 7], GPIO.OUT, initial=1)
    bcm.cleanup(6)
    assert (heard(board, 6), heard(board, 7)) == (0, 1)
    assert bcm.getmode() == GPIO.BCM
    bcm.cleanup()
    assert (heard(board, 6), heard(board, 7)) == (0, 0)
    assert bcm.getmode() is None
    with pytest.warns(RuntimeWarning) as caught:
        bcm.cleanup()
    assert str(caught[0].message) == (
        "No channels have been set up yet - nothing to clean up!  "
        "Try cleaning up at the end of your program instead!"
    )
    assert caught[0].filename == __file__
    bcm.setwarnings(False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bcm.cleanup()


def test_cleanup_resets_numbering_without_channels(bcm: Gpio) -> None:
    bcm.setwarnings(False)
    bcm.cleanup()
    assert bcm.getmode() == GPIO.BCM  # no pin is set up yet
    bcm.setup(7, GPIO.OUT)
    bcm.cleanup(7)
    assert bcm.getmode() == GPIO.BCM
    bcm.cleanup()
    assert bcm.getmode() is None


@pytest.mark.parametrize("hook_cleans_up", [False, True])
def test_cleanup_undoes_a_setup_that_a_signal_has_ended(
    bcm: Gpio, board: Board, hook_cleans_up: bool
) -> None:
    link = bcm._linked()
    ask = link.call

    def interrupted(operation: Setup) -> None:
        # Simulate a signal that arrives after the board has set the pin, but before its response.
        del vars(link)["call"]
        ask(operation)
        if not hook_cleans_up:
            raise KeyboardInterrupt
        bcm.cleanup()

    vars(link)["call"] = interrupted
    if hook_cleans_up:
        bcm.setup(7, GPIO.OUT, initial=1)
        bcm.setmode(GPIO.BCM)
        with pytest.raises(RuntimeError, match=r"^You must setup\(\) the GPIO channel first(\n|$)"):
            bcm.input(7)
    else:
        with pytest.raises(KeyboardInterrupt):
            bcm.setup(7, GPIO.OUT, initial=1)
        assert heard(board, 7) == 1
        bcm.cleanup()
    assert heard(board, 7) == 0
    assert board.state().pins[7].function is Function.IN


def test_a_signal_handlers_cleanup_lets_the_interrupted_call_end(bcm: Gpio, board: Board) -> None:
    bcm.setup(11, GPIO.IN)
    bcm.setup(7, GPIO.OUT)
    board.press(11)
    _synchronize(bcm, board)
    calls = {Gpio.input.__code__, Gpio.output.__code__}

    def interrupt(frame: FrameType, event: str, argument: object) -> None:
        # Simulate a signal at the first step of the call, whose handler runs before anything else.
        if event == "call" and frame.f_code in calls:
            sys.setprofile(None)
            with dispatching_signal():
                bcm.cleanup()

    sys.setprofile(interrupt)
    assert bcm.input(11) == 1
    with pytest.raises(RuntimeError, match=MODE[:20]):
        bcm.input(11)
    bcm.setmode(GPIO.BCM)
    bcm.setup(7, GPIO.OUT)
    sys.setprofile(interrupt)
    bcm.output(7, 1)
    with pytest.raises(RuntimeError, match=MODE[:20]):
        bcm.output(7, 1)


def test_cleanup_leaves_pins_of_other_processes(bcm: Gpio, board: Board) -> None:
    other = Gpio()
    other.setmode(GPIO.BCM)
    other.setup(5, GPIO.OUT, initial=1)
    bcm.setup(6, GPIO.OUT, initial=1)
    bcm.cleanup()
    assert (heard(board, 5), heard(board, 6)) == (1, 0)
    assert bcm.getmode() is None
    other.close()
    assert heard(board, 5) == 1


@pytest.mark.parametrize("keyword", ["gpio", "channel"])
def test_callback_of_a_press(bcm: Gpio, board: Board, keyword: str) -> None:
    bcm.setup(11, GPIO.IN)
    seen: list[tuple[int, int]] = []
    second = threading.Event()
    bcm.add_event_detect(
        edge=GPIO.RISING, callback=lambda pin: seen.append((pin, bcm.input(pin))), **{keyword: 11}
    )
    bcm.add_event_callback(11, lambda pin: second.set())
    board.press(11)
    assert second.wait(30)
    assert seen == [(11, 1)]
    with pytest.raises(RuntimeError, match=r"^Conflicting edge detection already enabled for this GPIO chan"):
        bcm.add_event_detect(11, GPIO.RISING)
    with pytest.raises(RuntimeError, match=r"^Conflicting edge detection events already exist for this GPIO"):
        bcm.wait_for_edge(11, GPIO.RISING)
    bcm.remove_event_detect(11)
    bcm.add_event_detect(11, GPIO.RISING)


def test_debounce(bcm: Gpio, board: Board) -> None:
    bcm.setup(11, GPIO.IN)
    seen: list[int] = []
    released = threading.Event()
    bcm.add_event_detect(11, GPIO.RISING, callback=seen.append, bouncetime=60_000)
    bcm.setup(12, GPIO.IN)
    bcm.add_event_detect(12, GPIO.RISING, callback=lambda pin: released.set())
    for _ in range(5):
        board.press(11)
        board.release(11)
    board.press(12)
    assert released.wait(30)
    assert seen == [11]


def test_event_detected_reads_and_clears(bcm: Gpio, board: Board) -> None:
    bcm.setup([11, 12], GPIO.IN)
    assert not bcm.event_detected(11)
    bcm.add_event_detect(11, GPIO.BOTH)
    board.press(11)
    _synchronize(bcm, board)
    assert bcm.event_detected(11)
    assert not bcm.event_detected(11)
    bcm.cleanup()
    bcm.setmode(GPIO.BCM)
    bcm.setup(11, GPIO.IN)
    board.release(11)
    _synchronize(bcm, board)
    assert not bcm.event_detected(11)


def test_wait_for_edge(bcm: Gpio, board: Board) -> None:
    bcm.setup(11, GPIO.IN)
    assert bcm.wait_for_edge(11, GPIO.BOTH, timeout=20) is None
    felt = threading.Event()

    def press_until_felt() -> None:
        # A press before the wait has started is not detected.
        while not felt.wait(0.05):
            board.release(11)
            board.press(11)

    finger = threading.Thread(target=press_until_felt)
    finger.start()
    assert bcm.wait_for_edge(11, GPIO.RISING, timeout=30_000) == 11
    felt.set()
    finger.join()
    _synchronize(bcm, board)
    bcm.add_event_detect(11, GPIO.RISING, bouncetime=50)
    with pytest.raises(RuntimeError, match=r"^Conflicting edge detection events already exist for this GPIO"):
        bcm.wait_for_edge(11, GPIO.RISING, timeout=20)
    assert bcm.wait_for_edge(11, GPIO.RISING, bouncetime=50, timeout=20) is None
    assert bcm.wait_for_edge(11, GPIO.FALLING, timeout=20) is None


def test_pwm_has_its_duty_cycle_and_ends_low(bcm: Gpio, board: Board) -> None:
    bcm.setup(7, GPIO.OUT)
    edges = board.watch([7], timeout=100)
    wave = Wave(bcm, bcm.output_pin(7), 20)
    with pytest.raises(RuntimeError, match=r"^A PWM object already exists for this GPIO channel$"):
        bcm.output_pin(7)
    with pytest.raises(ValueError, match=r"^dutycycle must have a value from 0\.0 to 100\.0$"):
        wave.set(duty=101)
    with pytest.raises(ValueError, match=r"^frequency must be greater than 0\.0$"):
        wave.set(frequency=0)
    wave.set(duty=30)
    wave.start()
    high = [0.0]
    # A machine that stalls makes some pulses longer, but only for a while.
    while sorted(high)[len(high) // 2] != pytest.approx(0.015, abs=0.008):
        several = [next(edges) for _ in range(11)]
        high = [after.time - edge.time for edge, after in itertools.pairwise(several) if edge.level]
    wave.set(duty=100)
    deadline = time.monotonic() + 100
    while not heard(board, 7) and time.monotonic() < deadline:
        next(edges)
    wave.stop()
    _synchronize(bcm, board)

    assert heard(board, 7) == 0
    assert bcm.output_pin(7) == 7


def test_pwm_object_ends_with_its_last_reference() -> None:
    GPIO.setmode(GPIO.BCM)
    GPIO.setup(7, GPIO.OUT)
    try:
        pwm = GPIO.PWM(7, 50)
        pwm.start(50)
        with pytest.raises(ValueError, match=r"^frequency must be greater than 0\.0$"):
            pwm.ChangeFrequency(-1)
        del pwm
        gc.collect()
        assert not [thread for thread in threading.enumerate() if thread.name.startswith("gpio-pwm")]
        GPIO.PWM(7, 50).stop()
    finally:
        GPIO.cleanup()
        GPIO._gpio.close()


def heard(board: Board, pin: int) -> int:
    """Return the level once ``board`` has received all of the server's changes."""
    board._link.call(None)
    return board.get(pin)


def _synchronize(gpio: Gpio, board: Board) -> None:
    """Return when both have received all changes."""
    gpio._linked().call(None)
    board._link.call(None)
