"""Workers: an exception in a function is logged, and the next function runs."""

from __future__ import annotations

import logging
import threading

import pytest

from minirospy.runtime.transport.workers import InOrder, Workers


@pytest.mark.parametrize("error", [ValueError("x"), SystemExit(3), GeneratorExit(), KeyboardInterrupt()])
def test_functions_after_one_that_raises_anything_run(
    error: BaseException, caplog: pytest.LogCaptureFixture
) -> None:
    workers = Workers()
    in_order = InOrder(workers)
    is_held, done = threading.Event(), threading.Event()

    def fail() -> None:
        is_held.wait(30)
        raise error

    with caplog.at_level(logging.ERROR):
        in_order.start(fail)
        in_order.start(done.set)
        is_held.set()
        assert done.wait(30)
    assert "fault in a worker" in caplog.text
    assert type(error).__name__ in caplog.text
