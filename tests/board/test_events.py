"""Which edges are counted. The test controls the clock."""

from __future__ import annotations

import threading

import pytest

from minirospy.board.events import CallbackThread, Detector, Slope
from tests.interruption import ends_elsewhere, interrupt_in_lock


@pytest.mark.parametrize(
    ("slope", "counted"), [(Slope.RISING, [1]), (Slope.FALLING, [0]), (Slope.BOTH, [1, 0])]
)
def test_slope(slope: Slope, counted: list[int]) -> None:
    detector = Detector(11, slope, None)
    assert [level for level in (1, 0) if detector.see(level, 0.0)] == counted


def test_debounce_reports_the_first_edge_then_is_deaf() -> None:
    detector = Detector(11, Slope.BOTH, 0.5)
    times = [10.0, 10.1, 10.4, 10.51, 10.6, 11.2]
    assert [time for time in times if detector.see(1, time)] == [10.0, 10.51, 11.2]


def test_edges_of_the_other_slope_do_not_block_detection() -> None:
    detector = Detector(11, Slope.RISING, 0.5)
    assert not detector.see(0, 1.0)
    assert detector.see(1, 1.1)


def test_taking_clears() -> None:
    detector = Detector(11, Slope.BOTH, None)
    assert not detector.take()
    detector.see(1, 0.0)
    assert detector.take()
    assert not detector.take()


def test_callbacks_run_in_order_on_one_thread_and_an_error_is_printed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    ran: list[tuple[str, int, int]] = []
    done = threading.Event()
    detector = Detector(11, Slope.BOTH, None)

    def fails(channel: int) -> None:
        raise RuntimeError("the user's mistake")

    def note(channel: int) -> None:
        ran.append(("note", channel, threading.get_ident()))
        if len(ran) == 2:
            done.set()

    detector.callbacks += [fails, note]
    thread = CallbackThread()
    thread.schedule(detector)
    thread.schedule(detector)
    assert done.wait(30)
    thread.close()
    assert [entry[:2] for entry in ran] == [("note", 11)] * 2
    assert len({entry[2] for entry in ran}) == 1
    assert ran[0][2] != threading.get_ident()
    assert "the user's mistake" in capsys.readouterr().err


def test_a_removed_detector_does_not_run() -> None:
    ran: list[int] = []
    detector = Detector(11, Slope.BOTH, None)
    detector.callbacks.append(ran.append)
    detector.active = False
    thread = CallbackThread()
    thread.schedule(detector)
    thread.close()
    assert ran == []


def test_ctrl_c_at_any_point_of_waiting_for_an_edge_leaves_the_detector_usable() -> None:
    detector = Detector(11, Slope.BOTH, None)
    interrupt_in_lock(lambda: detector.wait(0.001))
    assert ends_elsewhere(lambda: detector.see(1, 0.0))
    assert detector.take()
