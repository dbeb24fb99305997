"""`rosbag play --foxglove`: a timeline for front ends."""

from __future__ import annotations

import re
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ros.rosbag.test_play import make_bag
from tests.web.conftest import Client
from tests.web.test_foxglove_sessions import text_of

SECOND = 10**9
START = 1000 * SECOND
PLAYING, PAUSED, ENDED = 0, 1, 3


@pytest.fixture
def player(master: str, tmp_path: Path) -> Iterator[Client]:
    """Return a client of a player for a bag of 100 s with a message per second; the player is paused at the start."""
    name = make_bag(tmp_path / "a.bag", [("/a", number, f"message {number}") for number in range(101)])
    command = [
        sys.executable,
        "-m",
        "minirospy",
        "bag",
        "play",
        "--pause",
        "--foxglove",
        "--foxglove-port",
        "0",
    ]
    process = subprocess.Popen(
        [*command, "-q", str(tmp_path / name)], stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout
        line = process.stdout.readline()
        while "Foxglove protocol at" not in line:
            assert line
            line = process.stdout.readline()
        found = re.search(r":(\d+)$", line.strip())
        assert found
        client = Client(int(found[1]))
        yield client
        client.close()
    finally:
        process.terminate()
        process.communicate(timeout=60)
    assert process.returncode == 0


def control(
    client: Client, command: int, speed: float, seek: int | None, request: bytes
) -> tuple[int, int, float, int]:
    """Return the player's state in its response: status, time, speed, and whether it has seeked."""
    client.send_binary(
        struct.pack("<BBfBQI", 3, command, speed, seek is not None, seek or 0, len(request)) + request
    )
    while True:
        frame = client.next_binary(5)
        _, status, time, rate, did_seek, length = struct.unpack_from("<BBQfBI", frame)
        if frame[-length:] == request and length:
            return status, time, rate, did_seek


def test_front_end_controls_the_player(player: Client) -> None:
    info = player.next("serverInfo")
    assert {"time", "playbackControl"} <= set(info["capabilities"])
    assert info["dataStartTime"] == {"sec": 1000, "nsec": 0}
    assert info["dataEndTime"] == {"sec": 1100, "nsec": 0}
    player.subscribe("/a", 3)
    # Nothing else shows that the server is connected to the player's topics.
    control(player, 0, 1.0, None, b"connected")
    player.next_binary(1)

    status, time, speed, did_seek = control(player, 1, 50.0, START + 40 * SECOND, b"there")
    assert (status, time, speed, did_seek) == (PAUSED, START + 40 * SECOND, 50.0, 1)
    status, time, speed, did_seek = control(player, 0, 50.0, None, b"go")
    assert status == PLAYING
    assert not did_seek
    frame = player.next_binary(1)
    while int(text_of(frame)[1].split()[1]) < 40:
        frame = player.next_binary(1)
    assert text_of(frame) == (3, "message 40")
    (stamp,) = struct.unpack_from("<Q", frame, 5)
    assert START + 40 * SECOND <= stamp <= START + 100 * SECOND, "messages are stamped with the bag's time"
    for number in range(41, 101):
        assert text_of(player.next_binary(1)) == (3, f"message {number}")
    while player.next_binary(5)[1] != ENDED:
        pass

    # At the end of the bag, seek back and change the rate.
    status, time, _, _ = control(player, 0, 20.0, START + 98 * SECOND, b"back")
    assert status == PLAYING
    assert [text_of(player.next_binary(1))[1] for _ in range(3)] == [
        f"message {number}" for number in (98, 99, 100)
    ]
