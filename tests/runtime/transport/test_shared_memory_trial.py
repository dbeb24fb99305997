"""runtime/transport/shared_memory_trial: the reason why this machine has no shared memory."""

from __future__ import annotations

import contextlib
import mmap
import os
import sys
from typing import Any

import pytest

from minirospy.runtime.transport import shared_memory
from minirospy.runtime.transport.ring_receiver import RingReceiver
from minirospy.runtime.transport.shared_memory_trial import try_out
from tests.runtime.transport.conftest import no_map, no_memory, refuse

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not shared_memory.is_possible(), reason="rings need Linux"
)


def open_files() -> set[str]:
    """Return the open files of this process, except sockets and pipes, which other threads may open."""
    found = set()
    for number in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            found.add(f"{number} {os.readlink(f'/proc/self/fd/{number}')}")
    return {each for each in found if "memfd:" in each or "eventfd" in each}


def test_shared_memory_is_tried_out() -> None:
    files = open_files()
    assert try_out() == ""
    assert not open_files() - files


def forbidden(*_: Any) -> Any:
    raise PermissionError(1, "Operation not permitted")


@pytest.mark.parametrize(
    ("owner", "name", "broken", "why"),
    [
        (os, "memfd_create", forbidden, "Operation not permitted"),
        (os, "eventfd", forbidden, "Operation not permitted"),
        (os, "posix_fallocate", no_memory, "no space left"),
        (mmap, "mmap", no_map, "no mapping here"),
        (RingReceiver, "take_offer", refuse, "a file that another process passes cannot be mapped"),
        (RingReceiver, "read", lambda *_: b"other bytes", "a message did not arrive as it was sent"),
    ],
)
def test_a_machine_without_shared_memory_is_found_out(
    owner: Any, name: str, broken: Any, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = open_files()
    monkeypatch.setattr(owner, name, broken)
    assert try_out() == why
    assert not open_files() - files


def test_a_system_that_speaks_german_is_quoted_in_ascii(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_file(*_: Any) -> Any:
        raise OSError(12, "Zu wenig Speicher verfügbar")

    monkeypatch.setattr(os, "memfd_create", no_file)
    assert try_out() == "Zu wenig Speicher verf?gbar"
