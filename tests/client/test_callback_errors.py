"""Which errors in callbacks are logged, and when. The test controls the clock."""

from __future__ import annotations

import logging
import sys

import pytest

from minirospy.client.callback_errors import CallbackErrors


class Clock:
    """A clock that the test sets."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def errors(clock: Clock) -> CallbackErrors:
    return CallbackErrors(clock)


def fail(
    errors: CallbackErrors,
    text: str = "text",
    kind: type[Exception] = ValueError,
    callback: object = "CALLBACK",
) -> None:
    """Log an error that is always raised at the same line."""
    try:
        raise kind(text)
    except kind as error:
        errors.log(callback, error)


def messages(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return the logged messages, those with a traceback by their first and last lines."""
    assert all((record.name, record.levelno) == ("rosout", logging.ERROR) for record in caplog.records)
    lines = [record.getMessage().strip().splitlines() for record in caplog.records]
    caplog.clear()
    return [text[0] if len(text) == 1 else f"{text[0]} | {text[1]} | {text[-1]}" for text in lines]


IN_FULL = "bad callback: CALLBACK | Traceback (most recent call last): | {}"
COUNTED = "bad callback: CALLBACK: {} ({} more times; the first one is logged above)"


def test_the_same_error_is_logged_once_and_then_counted(
    errors: CallbackErrors, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    for tenth in range(100):
        clock.now = tenth / 10
        fail(errors, f"number {tenth}")
    assert messages(caplog) == [IN_FULL.format("ValueError: number 0")]

    for tenth in range(100, 250):
        clock.now = tenth / 10
        fail(errors, "two\nlines")
    assert messages(caplog) == [
        COUNTED.format("ValueError: two lines", 100),
        COUNTED.format("ValueError: two lines", 100),
    ]
    errors.close()
    errors.close()
    assert messages(caplog) == [COUNTED.format("ValueError: two lines", 49)]


def test_an_error_that_is_rare_is_logged_each_time(
    errors: CallbackErrors, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    fail(errors)
    clock.now = 60.0
    fail(errors)
    errors.close()
    assert messages(caplog) == [IN_FULL.format("ValueError: text"), COUNTED.format("ValueError: text", 1)]


def test_other_errors_are_logged_in_full(errors: CallbackErrors, caplog: pytest.LogCaptureFixture) -> None:
    fail(errors)
    fail(errors, "text", TypeError)
    fail(errors, callback=len)
    try:
        raise ValueError("text")
    except ValueError as error:
        errors.log("CALLBACK", error)
    value, kind = IN_FULL.format("ValueError: text"), IN_FULL.format("TypeError: text")
    assert messages(caplog) == [value, kind, value.replace("CALLBACK", str(len)), value]


def test_notes_do_not_replace_the_error(errors: CallbackErrors, caplog: pytest.LogCaptureFixture) -> None:
    for _ in range(2):
        try:
            raise ValueError("text")
        except ValueError as error:
            if sys.version_info >= (3, 11):
                error.add_note("a note")
            errors.log("CALLBACK", error)
    errors.close()
    assert caplog.messages[-1] == COUNTED.format("ValueError: text", 1)


def test_error_is_logged_even_if_the_callback_cannot_be_shown(
    errors: CallbackErrors, caplog: pytest.LogCaptureFixture
) -> None:
    class Broken:
        def __repr__(self) -> str:
            raise RuntimeError

    fail(errors, callback=Broken())
    assert caplog.messages[0].startswith("bad callback: <")
    assert "Broken whose str() fails>" in caplog.messages[0]
