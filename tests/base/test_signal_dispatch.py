"""Ctrl-Break on Windows, which a launcher sends to its children, is treated like Ctrl-C."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Iterator

import pytest

from minirospy.base.signal_dispatch import interrupt_signals
from minirospy.command.command import run
from minirospy.ros.rosmaster.commands import master
from minirospy.ros.rosunit.runner.bare import interrupt_noted


@pytest.fixture
def control_break(monkeypatch: pytest.MonkeyPatch) -> Iterator[signal.Signals]:
    """Yield SIGBREAK or, on other systems, another signal under that name."""
    number: signal.Signals = getattr(signal, "SIGBREAK" if sys.platform == "win32" else "SIGUSR1")
    monkeypatch.setattr(signal, "SIGBREAK", number, raising=False)
    before = signal.signal(number, signal.SIG_DFL)
    yield number
    signal.signal(number, before)


@pytest.mark.skipif(sys.platform == "win32", reason="has Ctrl-Break")
def test_only_windows_has_a_second_signal() -> None:
    assert interrupt_signals() == [signal.SIGINT]


def test_control_break_interrupts_a_command(control_break: signal.Signals) -> None:
    assert interrupt_signals() == [signal.SIGINT, control_break]

    def body() -> int:
        signal.raise_signal(control_break)
        return 1

    assert run("test", body, interrupted=130) == 130


def test_control_break_is_noted_while_a_test_runs(control_break: signal.Signals) -> None:
    with interrupt_noted() as noted:
        assert not noted.is_set()
        signal.raise_signal(control_break)
        assert noted.is_set()
    assert signal.getsignal(control_break) == signal.SIG_DFL


def test_control_break_stops_a_master(control_break: signal.Signals) -> None:
    names = ("SIGINT", "SIGTERM", "SIGHUP")
    before = {number: signal.getsignal(number) for name in names if (number := getattr(signal, name, None))}

    async def wait() -> None:
        stop = master._stop_event()
        signal.raise_signal(control_break)
        await stop.wait()

    try:
        asyncio.run(wait())
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
