"""runtime/transport/rate_limited_logger: logs the first of many equal lines, then the number of the others."""

from __future__ import annotations

import logging

import pytest

from minirospy.runtime.transport import rate_limited_logger
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger


def test_a_flood_is_logged_as_its_first_line_and_a_count(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr(rate_limited_logger.time, "monotonic", lambda: now[0])
    logger = logging.getLogger("test-rate-limit")
    limited = RateLimitedLogger(logger)

    for number in range(1000):
        limited.warning("%s is bad", number)
        now[0] += 0.001

    now[0] += 10.0
    limited.error("%s is worse", "this")
    now[0] += 10.0
    limited.error("%s too", "that")
    assert [record.getMessage() for record in caplog.records] == [
        "0 is bad",
        "this is worse (and 999 more like it before)",
        "that too",
    ]
    assert [record.levelname for record in caplog.records] == ["WARNING", "ERROR", "ERROR"]
    assert all(record.filename == "test_rate_limited_logger.py" for record in caplog.records)


def test_the_requested_number_of_lines_and_a_count_of_the_others(
    caplog: pytest.LogCaptureFixture,
) -> None:
    limited = RateLimitedLogger(logging.getLogger("test-rate-limit"), 3)
    for number in range(8):
        limited.warning("%s", f"100 % {number}")
    limited.close()
    limited.close()
    assert [record.getMessage() for record in caplog.records] == [
        "100 % 0",
        "100 % 1",
        "100 % 2",
        "5 more like the last ones",
    ]


def test_text_of_a_peer_does_not_start_another_line(caplog: pytest.LogCaptureFixture) -> None:
    log = RateLimitedLogger(logging.getLogger("test-rate-limit"), 3)
    log.warning("%s: %s, %d", "/a\nWARN forged\x1b[2J", OSError("x\ny"), 1)
    assert caplog.records[0].getMessage() == "/a\\nWARN forged\\x1b[2J: x\\ny, 1"
