"""roslaunch's messages on streams that cannot be written."""

from __future__ import annotations

import errno
import io
import os
import sys

import pytest

from minirospy.ros.roslaunch.launcher.output import ERROR, INFO, Output


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO, errno.EPIPE])
def test_output_continues_without_a_line_that_cannot_be_written(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk, a closed terminal or a reader that has exited must not end the launch, nor its shutdown."""

    class Failing(io.StringIO):
        def flush(self) -> None:
            raise OSError(number, os.strerror(number))

    monkeypatch.setattr(sys, "stdout", Failing())
    monkeypatch.setattr(sys, "stderr", Failing())
    heard: list[tuple[int, str]] = []
    output = Output(listener=lambda level, text: heard.append((level, text)))
    output.print("process[a-1]: started")
    output.warn("[a-1] process has died")
    assert heard == [(INFO, "process[a-1]: started"), (ERROR, "[a-1] process has died")]
