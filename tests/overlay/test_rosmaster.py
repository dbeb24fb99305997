"""A master inside a program, as third-party tests start one."""

from __future__ import annotations

import threading
import time

import pytest
import rosgraph
import rosmaster
import rosmaster.master
import rosmaster.threadpool
import roswtf


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_master_in_the_program() -> None:
    master = rosmaster.master.Master(port=0)
    assert not master.ok()
    master.start()
    try:
        assert master.ok()
        assert master.uri is not None
        client = rosgraph.Master("/tester", master.uri)
        client.setParam("/a", 5)
        assert client.getParam("/a") == 5
        with pytest.raises(OSError, match="in use"):
            rosmaster.master.Master(master.port).start()
        uri = master.uri
    finally:
        master.stop()
    master.stop()
    assert not master.ok()
    assert not rosgraph.is_master_online(uri)


def test_names() -> None:
    assert rosmaster.DEFAULT_MASTER_PORT == 11311
    assert callable(rosmaster.rosmaster_main)
    assert callable(roswtf.roswtf_main)


def test_main_thread_joins_a_pool_without_waiting_on_a_condition(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Ctrl-C while Condition.wait() releases the lock would raise RuntimeError."""
    wait = threading.Condition.wait

    def wait_elsewhere(condition: threading.Condition, timeout: float | None = None) -> bool:
        assert threading.get_ident() != joining
        return wait(condition, timeout)

    joining = threading.get_ident()
    pool = rosmaster.threadpool.MarkedThreadPool(1)
    held, done = threading.Event(), threading.Event()
    pool.queue_task("slow", held.wait, (60,))
    pool.queue_task("slow", done.set)

    def release() -> None:
        # The pool accepts no number of threads while join_all() waits.
        while pool.set_thread_count(1):
            time.sleep(0.001)
        held.set()

    thread = threading.Thread(target=release, daemon=True)
    thread.start()
    with monkeypatch.context() as patched:
        patched.setattr(threading.Condition, "wait", wait_elsewhere)
        pool.join_all()
    assert done.is_set()
    assert pool.get_thread_count() == 0
    assert pool.set_thread_count(1)
    pool.join_all()
    thread.join(60)
    assert not thread.is_alive()
