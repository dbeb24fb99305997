"""A node in a separate process under attack: it continues to respond, and its memory use and log stay small.

benchmarks/bad_peers.py has the same attacks, and measures them.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from xmlrpc.client import ServerProxy

import pytest

SCRIPT = Path(__file__).parents[3] / "benchmarks" / "bad_peers.py"
PEERS = 200


@pytest.fixture(scope="module")
def bad_peers() -> ModuleType:
    spec = importlib.util.spec_from_file_location("bad_peers", SCRIPT)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["bad_peers"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def victim(master: str, bad_peers: ModuleType) -> Iterator[tuple[object, str, str]]:
    """Return the node, its XML-RPC address and its services' address."""
    node = bad_peers.Victim([sys.executable, "-c", bad_peers.NODE], dict(os.environ), "ready")
    with ServerProxy(master) as proxy:
        api, service = proxy.lookupNode("/test", "/victim"), proxy.lookupService("/test", "/flag")
    yield node, api[2], service[2]  # type: ignore[index]
    node.close()


def test_bad_peers(victim: tuple[object, str, str], bad_peers: ModuleType, master: str) -> None:
    node, api, service = victim
    ask: Callable[[], None] = lambda: bad_peers.ask_node(api, service)  # noqa: E731
    tcpros, xmlrpc = bad_peers.port_of(service), bad_peers.port_of(api)
    short = bad_peers.bad_publisher(master, b"\x05\0\0\0short")
    attacks = [
        (bad_peers.garbage, xmlrpc),
        (bad_peers.half_request, xmlrpc),
        (bad_peers.silent, tcpros),
        (bad_peers.half_header, tcpros),
        (bad_peers.huge_request, tcpros),
        (short, 0),
    ]
    start_time = time.monotonic()

    for attack, port in attacks:
        row = bad_peers.measure(attack.__name__, node, attack, port, PEERS, ask)
        assert row.answered, row
        assert row.height - row.before < 40, row

    # At most ten lines of each kind are logged in ten seconds; each attack opens two hundred connections.
    most = 30 * (1 + (time.monotonic() - start_time) // 10)
    assert len(node.lines) < most, node.lines  # type: ignore[attr-defined]
