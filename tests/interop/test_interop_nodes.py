"""Nodes of minirospy, rospy and roscpp communicate, with minirospy's master and with the real one."""

from __future__ import annotations

import subprocess
from collections.abc import Callable

import pytest

from tests.interop.conftest import PATIENCE

Peer = Callable[[str, str, str], "subprocess.Popen[str]"]

PAIRS = [("ours", "rospy"), ("rospy", "ours"), ("ours", "roscpp"), ("roscpp", "ours"), ("ours", "ours")]


def lines_until_ready(program: subprocess.Popen[str]) -> list[str]:
    """Return the lines that a peer prints before "ready"."""
    assert program.stdout
    lines = []
    for line in program.stdout:
        if line.strip() == "ready":
            return lines
        lines.append(line.strip())
    assert program.stderr
    raise AssertionError(f"the peer ended before it was ready: {program.stderr.read()}")


@pytest.mark.parametrize(("talker", "listener"), PAIRS)
def test_messages_arrive_byte_for_byte(any_master: str, peer: Peer, talker: str, listener: str) -> None:
    """Send Bool, String, LaserScan with 1651 beams, and a 6 MB Image to a subscriber that joins late."""
    said = lines_until_ready(peer(talker, "talk", any_master))
    output, errors = peer(listener, "listen", any_master).communicate(timeout=PATIENCE)
    heard = {
        line for line in output.splitlines() if line.split(" ")[0] in {"bool", "string", "scan", "image"}
    }
    assert len(said) == 4
    assert sorted(heard) == sorted(said), errors


@pytest.mark.parametrize(("talker", "listener"), PAIRS)
def test_messages_arrive_if_the_subscriber_started_first(
    any_master: str, peer: Peer, talker: str, listener: str
) -> None:
    hearing = peer(listener, "listen", any_master)
    said = lines_until_ready(peer(talker, "talk", any_master))
    output, errors = hearing.communicate(timeout=PATIENCE)
    heard = {
        line for line in output.splitlines() if line.split(" ")[0] in {"bool", "string", "scan", "image"}
    }
    assert sorted(heard) == sorted(said), errors


@pytest.mark.parametrize(("server", "client"), PAIRS)
def test_services_answer_between_all_clients(any_master: str, peer: Peer, server: str, client: str) -> None:
    """Each client calls with one connection per call, and with a persistent connection."""
    lines_until_ready(peer(server, "serve", any_master))
    output, errors = peer(client, "call", any_master).communicate(timeout=PATIENCE)
    answers = [line for line in output.splitlines() if "flag:" in line]
    assert answers == ["True flag: True", "False flag: False"] * 2, errors
