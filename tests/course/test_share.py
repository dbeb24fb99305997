"""`minirospy check --share`: the board and the nodes of a student's computer at the class's master."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import MasterUnreachableError, RpcRefused
from minirospy.board.board import Board
from minirospy.course.results import MAX_KEY, Record, parameter_key, send
from minirospy.course.share import share
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.web.dashboard.files import FOLDER


def wait_for(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_state_of_the_board_is_at_the_master(master: str) -> None:
    environment = Environment.read()
    record = Record.read(environment)
    record.student = "Anna"
    proxy = MasterProxy(master, "/teacher")
    ended = threading.Event()
    sharing = threading.Thread(target=share, args=(record, environment, ended.is_set))
    sharing.start()

    def now() -> dict[str, Any]:
        try:
            found: dict[str, Any] = proxy.get_param("/minirospy_class/Anna/now")
        except RpcRefused:
            return {}
        return found

    try:
        wait_for(lambda: now().get("leds") == "000000")
        first = now()["beat"]
        with Board() as board:
            board.set(7, 1)
            board.press(11)
            wait_for(lambda: (now()["leds"], now()["buttons"]) == ("000001", "10"))
            board.reset()
        assert now()["beat"] > first
        # A result that is sent later leaves the state, and a beat leaves the results.
        send(record, master)
        assert proxy.get_param("/minirospy_class/Anna/student") == "Anna"
        beat = now()["beat"]
        wait_for(lambda: now()["beat"] > beat)
        assert proxy.get_param("/minirospy_class/Anna/student") == "Anna"
    finally:
        ended.set()
        sharing.join()
        proxy.close()


def test_missing_master_is_an_error() -> None:
    record = Record.read(Environment.read())
    record.master = "http://localhost:1"
    with pytest.raises(MasterUnreachableError):
        share(record, Environment.read(), lambda: True)


def test_names_become_different_parameters() -> None:
    names = ["Anna", "Jörg", "Jürg", "Anna B.", "Anna_B_", "7", "日本"]
    keys = [parameter_key(name) for name in names]
    assert len(set(keys)) == len(names)
    assert keys[0] == "Anna"
    assert all(key.isascii() and key[0].isalpha() and key.replace("_", "a").isalnum() for key in keys)


def test_key_of_a_long_name_fits_the_page() -> None:
    script = (FOLDER / "js" / "classroom.js").read_text(encoding="utf-8")
    found = re.search(r"const NAME = /(\^.*\$)/;", script)
    assert found
    pattern = re.compile(found[1])
    long = ["x" * count for count in range(MAX_KEY - 4, MAX_KEY + 20)]
    names = [*long, "ö" * 100, "7" * 100, "ö" * 99, f"{'x' * 200}a", f"{'x' * 200}b"]
    keys = [parameter_key(name) for name in names]
    assert len(set(keys)) == len(names)
    assert keys[:5] == long[:5]
    assert max(map(len, keys)) == MAX_KEY
    assert all(pattern.match(key) for key in keys)
