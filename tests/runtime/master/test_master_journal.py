"""The journal of a killed master, and its recovery by the next master."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Coroutine, Sequence
from contextlib import ExitStack
from http.client import HTTPException
from pathlib import Path
from typing import Any
from xmlrpc.client import Fault, ServerProxy

import pytest

from minirospy.base.errors import RpcFault, RpcUnreachable
from minirospy.core.wire.journal import HEAD, parse_journal
from minirospy.core.wire.xmlrpc import parse_response, serialize_response
from minirospy.runtime.master import journal as journal_module
from minirospy.runtime.master import master as master_module
from minirospy.runtime.master.journal import Journal
from minirospy.runtime.master.master import Master
from minirospy.runtime.master.replay import Replay
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.transport.loop import LoopThread
from tests.conftest import free_port
from tests.patience import PATIENCE
from tests.waiting import until, wait_until

BIN = Path(sys.executable).parent


class Fakes:
    """Nodes that respond to each call with success, each on its own port, on the test's loop."""

    def __init__(self) -> None:
        self.called: list[tuple[int, str, list[Any]]] = []
        self._servers: dict[str, RpcServer] = {}
        self._held: list[socket.socket] = []

    async def open(self, name: str = "") -> str:
        """Start a node that returns ``name`` for getName; return its URI."""

        def answer(method: str, args: Sequence[Any]) -> list[Any]:
            self.called.append((server.port, method, list(args)))
            return [1, "", name if method == "getName" else 0]

        server = RpcServer(answer)
        await server.start()
        uri = f"http://127.0.0.1:{server.port}/"
        self._servers[uri] = server
        return uri

    async def close(self, uri: str = "") -> None:
        """Close all nodes, or only the one with this URI; its port then refuses connections until all are closed."""
        for each in [uri] if uri else list(self._servers):
            await self._servers.pop(each).close()
        # A transport closes its socket in the next loop iteration.
        await asyncio.sleep(0.01)
        if uri:
            self._hold(int(uri.rpartition(":")[2].rstrip("/")))
        else:
            while self._held:
                self._held.pop().close()

    def _hold(self, port: int) -> None:
        """Bind a closed node's port without listening, so that no server of another test can get it."""
        sock = socket.socket()
        self._held.append(sock)
        # Binding fails as long as a connection of the node occupies the port.
        with contextlib.suppress(OSError):
            sock.bind(("127.0.0.1", port))


def run(test: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(test, PATIENCE))


def test_port_of_a_closed_node_refuses_connections_and_stays_taken() -> None:
    async def test() -> None:
        nodes = Fakes()
        uri = await nodes.open()
        await nodes.close(uri)
        port = int(uri.rpartition(":")[2].rstrip("/"))
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", port), PATIENCE)
        with pytest.raises(OSError, match="in use"):
            await RpcServer(lambda *_: [1, "", 0], port=port).start()
        await nodes.close()

    run(test())


def state(master: Master) -> Any:
    """Return everything that a master returns in response to queries."""
    query = master.dispatch
    found = [query(what, ["/x"])[2] for what in ("getSystemState", "getTopicTypes", "getParamNames")]
    nodes = sorted(master.registry.nodes().items())
    services = {name: query("lookupService", ["/x", name])[2] for name, _ in found[0][2]}
    return [found, query("getParam", ["/x", "/"]), nodes, services, sorted(master.parameters.subscriptions())]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "master" / "journal-1"


async def start(path: Path, **options: Any) -> Master:
    master = Master(journal=path, **options)
    await master.start()
    return master


def call(master: Master, method: str, *args: Any) -> Any:
    answer = master.dispatch(method, args)
    assert answer[0] == 1, answer
    return answer[2]


def test_killed_master_is_recovered_whole(path: Path) -> None:
    async def test() -> None:
        nodes = Fakes()
        uri, other = await nodes.open(), await nodes.open()
        first = await start(path)
        call(first, "registerPublisher", "/a", "/t", "std_msgs/Bool", uri)
        call(first, "registerPublisher", "/b", "/t", "std_msgs/Bool", other)
        call(first, "registerSubscriber", "/a", "/u", "*", uri)
        call(first, "registerService", "/b", "/s", "rosrpc://x:1", other)
        call(first, "subscribeParam", "/b", other, "/p")
        call(first, "setParam", "/a", "/p", {"q": [1, 2.5, "x", True, b"\0"], "r": {}})
        call(first, "setParam", "/a", "/gone", 1)
        call(first, "deleteParam", "/a", "/gone")
        call(first, "registerPublisher", "/a", "/left", "std_msgs/Bool", uri)
        call(first, "unregisterPublisher", "/a", "/left", uri)
        before = state(first)
        await first.close(keep_journal=True)

        nodes.called.clear()
        second = await start(path)
        assert state(second) == before
        assert "recovered 2 nodes and 1 parameter of" in second.news[0]
        # The nodes may have missed a call while no master was running, so they are notified of the current state.
        await until(
            lambda: {method for _, method, _ in nodes.called} == {"getName", "publisherUpdate", "paramUpdate"}
        )
        assert state(second) == before
        await second.close()
        assert not path.exists()
        await nodes.close()

    run(test())


def test_clean_shutdown_leaves_nothing(path: Path) -> None:
    async def test() -> None:
        first = await start(path)
        call(first, "setParam", "/a", "/p", 1)
        assert path.exists()
        await first.close()
        await first.close()
        assert not path.exists()
        second = await start(path)
        assert (second.news, call(second, "getParamNames", "/x")) == ([], [])
        await second.close()

    run(test())


def test_fresh_start_recovers_nothing(path: Path) -> None:
    async def test() -> None:
        first = await start(path)
        call(first, "setParam", "/a", "/p", 1)
        await first.close(keep_journal=True)
        second = await start(path, fresh=True)
        assert call(second, "getParamNames", "/x") == []
        await second.close()

    run(test())


def test_dead_nodes_are_forgotten_and_their_subscribers_notified(path: Path) -> None:
    async def test() -> None:
        nodes = Fakes()
        live, dead, stranger = (
            await nodes.open("/live"),
            await nodes.open(),
            await nodes.open("/somebody_else"),
        )
        first = await start(path)
        call(first, "registerSubscriber", "/live", "/t", "a/B", live)
        call(first, "registerPublisher", "/dead", "/t", "a/B", dead)
        call(first, "registerPublisher", "/stranger", "/t", "a/B", stranger)
        call(first, "subscribeParam", "/dead", dead, "/p")
        await first.close(keep_journal=True)
        await nodes.close(dead)

        nodes.called.clear()
        second = await start(path)
        assert len(second.registry.nodes()) == 3
        await until(lambda: second.registry.nodes() == {"/live": live})
        assert list(second.parameters.subscriptions()) == []
        await until(lambda: ("publisherUpdate", ["/master", "/t", []]) in [each[1:] for each in nodes.called])
        # The node is unregistered permanently: it does not return after the next crash.
        await second.close(keep_journal=True)
        third = await start(path)
        assert third.registry.nodes() == {"/live": live}
        await third.close()
        await nodes.close()

    run(test())


@pytest.mark.parametrize("lives", [True, False])
@pytest.mark.parametrize("reason", ["another boot", "long ago"])
def test_old_session_is_recovered_only_if_a_node_answers(
    path: Path, lives: bool, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def test() -> None:
        nodes = Fakes()
        uri = await nodes.open()
        first = await start(path)
        call(first, "registerPublisher", "/a", "/t", "a/B", uri)
        call(first, "setParam", "/a", "/p", 1)
        await first.close(keep_journal=True)
        if not lives:
            await nodes.close(uri)
        if reason == "another boot":
            monkeypatch.setattr(journal_module, "boot_id", lambda: "another")
        else:
            os.utime(path, (time.time() - 86400 * 3,) * 2)
        if lives:
            # On a busy machine the node's response may arrive late.
            monkeypatch.setattr(master_module, "QUICK_CHECK_SECONDS", 30.0)
        second = await start(path)
        assert call(second, "getParamNames", "/x") == (["/p"] if lives else [])
        assert set(second.registry.nodes()) == ({"/a"} if lives else set())
        assert ("recovered" if lives else "left behind: none of these nodes answers") in second.news[0]
        await second.close()
        await nodes.close()

    run(test())


class Answers:
    """Replaces the master's calls to nodes: scripted results, and a record of the attempts."""

    def __init__(self, patch: pytest.MonkeyPatch, *answers: Any) -> None:
        self.calls: list[tuple[str, str, float]] = []
        self._answers = list(answers)
        patch.setattr(master_module, "AsyncRpcClient", lambda **_: self)

    async def call(self, uri: str, method: str, *args: Any, timeout: float) -> Any:
        self.calls.append((uri, method, timeout))
        answer = self._answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    async def close(self) -> None:
        pass


def unreachable(cause: Exception) -> RpcUnreachable:
    error = RpcUnreachable("http://127.0.0.1:1/", "why")
    error.__cause__ = cause
    return error


SILENCE = unreachable(TimeoutError())


@pytest.mark.parametrize(
    ("answers", "tries", "is_kept"),
    [
        ([SILENCE] * 4, 3, False),
        ([SILENCE, SILENCE, [1, "", "/a"]], 3, True),
        ([[1, "", 0]], 1, True),
        ([[1, "", ""]], 1, True),
        ([[1, "", "/another"]], 1, False),
        ([[0, "", "/another"]], 1, True),
        (["anything"], 1, True),
        ([RpcFault(1, "no such method")], 1, True),
        ([SILENCE, unreachable(ConnectionRefusedError())], 2, False),
        ([unreachable(EOFError())], 1, False),
    ],
)
def test_recovered_node_is_forgotten_after_three_tries_of_three_seconds(
    path: Path, answers: list[Any], tries: int, is_kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    uri = "http://127.0.0.1:1/"

    async def test() -> None:
        first = await start(path)
        call(first, "registerPublisher", "/a", "/t", "a/B", uri)
        await first.close(keep_journal=True)
        nodes = Answers(monkeypatch, *answers)
        second = await start(path)
        assert second.checking
        await second.checking
        assert nodes.calls == [(uri, "getName", 3.0)] * tries
        assert set(second.registry.nodes()) == ({"/a"} if is_kept else set())
        await second.close()

    run(test())


@pytest.mark.parametrize(("age", "is_asked"), [(590.0, False), (610.0, True)])
def test_nodes_of_a_session_of_ten_minutes_ago_are_tried_once_for_a_second(
    path: Path, age: float, is_asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    uri = "http://127.0.0.1:1/"

    async def test() -> None:
        first = await start(path)
        call(first, "registerPublisher", "/a", "/t", "a/B", uri)
        await first.close(keep_journal=True)
        os.utime(path, (time.time() - age,) * 2)
        nodes = Answers(monkeypatch, *[SILENCE] * 10)
        second = await start(path)
        if is_asked:
            assert nodes.calls == [(uri, "getName", 1.0)]
            assert not second.registry.nodes()
            assert second.news == [
                "journal: 1 node and 0 parameters of the master that stopped 10 minutes ago are left behind: "
                "none of these nodes answers"
            ]
        else:
            assert second.news == [
                "journal: recovered 1 node and 0 parameters of the master that stopped 10 minutes ago"
            ]
        await second.close()

    run(test())


def test_master_gives_a_sign_of_life_every_thirty_seconds(path: Path) -> None:
    async def test() -> None:
        loop = asyncio.get_running_loop()
        before = loop.time()
        master = await start(path)
        os.utime(path, (1, 1))
        assert master.touching
        assert before + 30 <= master.touching.when() <= loop.time() + 30
        # Call the timer's function.
        first = master.touching
        master.touch()
        assert path.stat().st_mtime > 1
        assert master.touching is not first
        first.cancel()
        await master.close()

    run(test())


@pytest.mark.parametrize("damage", ["torn", "changed", "empty", "not a journal"])
def test_damaged_journal_is_recovered_up_to_the_damage(path: Path, damage: str) -> None:
    async def test() -> None:
        first = await start(path)
        for number in range(10):
            call(first, "setParam", "/a", f"/p{number}", number)
        await first.close(keep_journal=True)
        data = bytearray(path.read_bytes())
        if damage == "torn":
            del data[-3:]
        elif damage == "changed":
            data[-3] ^= 1
        path.write_bytes({"empty": b"", "not a journal": b"x" * 100}.get(damage, bytes(data)))
        second = await start(path)
        kept = 9 if damage in {"torn", "changed"} else 0
        assert call(second, "getParamNames", "/x") == [f"/p{number}" for number in range(kept)]
        assert "recovered up to the last whole record" in second.news[0]
        assert path.with_name("journal-1.damaged").exists()
        # Data written from now on is not damaged.
        assert parse_journal(path.read_bytes()).damage == ""
        await second.close()

    run(test())


def test_two_masters_never_share_a_journal(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(master_module, "LOCK_SECONDS", 0.0)

    async def test() -> None:
        first = await start(path)
        second = await start(path)
        assert second.news == [
            f"no journal: {path} is held by another master (pid {os.getpid()}), it is tried again every 30 s"
        ]
        call(second, "setParam", "/a", "/p", 1)
        call(first, "setParam", "/a", "/q", 1)
        await second.close()
        await first.close(keep_journal=True)
        third = await start(path)
        assert call(third, "getParamNames", "/x") == ["/q"]
        await third.close()

    run(test())


def test_journal_of_another_master_is_written_once_that_one_has_ended(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(master_module, "LOCK_SECONDS", 0.0)
    monkeypatch.setattr(journal_module, "RETRY_SECONDS", 0.0)

    async def test() -> None:
        first = await start(path)
        call(first, "setParam", "/a", "/q", 1)
        second = await start(path)
        os.utime(path, (0, 0))
        second.touch()
        assert path.stat().st_mtime == 0
        call(second, "setParam", "/a", "/p", 1)
        assert "held by another master" in call(second, "minirospy.status", "/x")["journal"]
        await first.close()
        call(second, "setParam", "/a", "/r", 1)
        assert str(path) in call(second, "minirospy.status", "/x")["journal"]
        await second.close(keep_journal=True)
        third = await start(path)
        assert call(third, "getParamNames", "/x") == ["/p", "/r"]
        await third.close()

    run(test())


def test_master_without_the_port_never_locks_the_journal(path: Path) -> None:
    """Otherwise it could hold the lock for a moment, and the master that got the port would run without a journal."""

    async def test() -> None:
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            with pytest.raises(OSError, match="in use"):
                await start(path, port=other.getsockname()[1])
        assert not path.parent.exists()

    run(test())


def test_master_waits_for_the_lock_of_one_that_exits(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(master_module, "LOCK_SECONDS", 20.0)

    async def test() -> None:
        ending = Journal(path, lambda: [["set", "/", {"p": 1}]])
        ending.start()
        second = Master(journal=path)
        starting = asyncio.ensure_future(second.start())
        await until(lambda: second.port)
        await asyncio.sleep(0.05)
        assert not starting.done()
        ending.close()
        await starting
        assert call(second, "getParamNames", "/x") == ["/p"]
        assert call(second, "minirospy.status", "/x")["journal"].startswith(str(path))
        await second.close()

    run(test())


def test_master_without_the_port_leaves_the_journal_unchanged(path: Path) -> None:
    async def test() -> None:
        first = await start(path)
        call(first, "setParam", "/a", "/q", 1)
        await first.close(keep_journal=True)
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            with pytest.raises(OSError, match="in use"):
                await start(path, port=other.getsockname()[1])
        second = await start(path)
        assert call(second, "getParamNames", "/x") == ["/q"]
        await second.close()

    run(test())


def test_full_disk_does_not_stop_the_master(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def test() -> None:
        master = await start(path)
        call(master, "setParam", "/a", "/before", 1)
        real = os.write

        def full(file: int, data: Any) -> int:
            real(file, bytes(data)[:5])
            raise OSError(errno.ENOSPC, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr(journal_module.os, "write", full)
            call(master, "setParam", "/a", "/during", 1)
        assert "No space left" in call(master, "minirospy.status", "/x")["journal"]
        monkeypatch.setattr(journal_module, "RETRY_SECONDS", 0.0)
        call(master, "setParam", "/a", "/after", 1)
        assert "failing" not in call(master, "minirospy.status", "/x")["journal"]
        await master.close(keep_journal=True)
        second = await start(path)
        assert call(second, "getParamNames", "/x") == ["/before", "/during", "/after"]
        await second.close()

    run(test())


def full_disk(patch: pytest.MonkeyPatch, room: int = 0) -> None:
    """Let the journal's files grow by only ``room`` bytes; if that is 0, do not allow any new file."""
    real_open, real_write, left = os.open, os.write, [room]

    def open_(path: Any, flags: int, mode: int = 0o777, **options: Any) -> int:
        if flags & os.O_CREAT and not room and not os.path.exists(path):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        return real_open(path, flags, mode, **options)

    def write(file: int, data: Any) -> int:
        taken = bytes(data)[: left[0]]
        left[0] -= len(taken)
        if not taken:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real_write(file, taken)

    patch.setattr(os, "open", open_)
    patch.setattr(os, "write", write)


@pytest.mark.parametrize("room", [0, 3, 40], ids=["no new file", "not even the pid", "half a rewrite"])
@pytest.mark.parametrize("has_lock", [True, False], ids=["lock file", "no lock file"])
def test_start_on_a_full_disk_recovers_and_retries_the_journal(
    path: Path, room: int, has_lock: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def test() -> None:
        nodes = Fakes()
        live, dead = await nodes.open(), await nodes.open()
        first = await start(path)
        call(first, "registerPublisher", "/live", "/t", "a/B", live)
        call(first, "registerPublisher", "/dead", "/t", "a/B", dead)
        call(first, "setParam", "/live", "/p", {"of": "before"})
        await first.close(keep_journal=True)
        await nodes.close(dead)
        if not has_lock:
            path.with_name("journal-1.lock").unlink()
        before = path.read_bytes()

        with monkeypatch.context() as patch:
            full_disk(patch, room)
            second = await start(path)
            assert call(second, "getParam", "/x", "/p") == {"of": "before"}
            assert "recovered 2 nodes and 1 parameter" in second.news[0]
            assert "No space left on device; set ROS_HOME (it is tried again every 30 s)" in second.news[1]
            assert call(second, "minirospy.status", "/x")["journal"] == "failing: No space left on device"
            # Nodes that do not respond are unregistered nevertheless.
            await until(lambda: set(second.registry.nodes()) == {"/live"})
            assert path.read_bytes() == before
            assert not path.with_name("journal-1.new").exists()

        call(second, "setParam", "/live", "/q", 1)
        assert path.read_bytes() == before, "it is too early to try again"
        monkeypatch.setattr(journal_module, "RETRY_SECONDS", 0.0)
        call(second, "setParam", "/live", "/r", 2)
        await second.close(keep_journal=True)
        third = await start(path)
        assert call(third, "getParamNames", "/x") == ["/p/of", "/q", "/r"]
        assert set(third.registry.nodes()) == {"/live"}
        await third.close()
        await nodes.close()

    run(test())


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_journal_in_a_read_only_folder_is_recovered(path: Path) -> None:
    async def test() -> None:
        first = await start(path)
        call(first, "setParam", "/a", "/p", 1)
        await first.close(keep_journal=True)
        path.with_name("journal-1.lock").unlink()
        path.parent.chmod(0o500)
        try:
            second = await start(path)
            assert call(second, "getParamNames", "/x") == ["/p"]
            assert "Permission denied" in second.news[-1]
            await second.close()
        finally:
            path.parent.chmod(0o700)

    run(test())


def test_failed_journal_is_retried_without_a_call(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def test() -> None:
        with monkeypatch.context() as patch:
            full_disk(patch)
            path.parent.mkdir()
            master = await start(path)
            master.parameters.set("/p", 1, "")
        monkeypatch.setattr(journal_module, "RETRY_SECONDS", 0.0)
        master.touch()
        assert not call(master, "minirospy.status", "/x")["journal"].startswith("failing")
        assert ["set", "/", {"p": 1}] in parse_journal(path.read_bytes()).records
        await master.close()

    run(test())


def test_fresh_start_on_a_full_disk_leaves_nothing_to_recover(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def test() -> None:
        first = await start(path)
        call(first, "setParam", "/a", "/p", 1)
        await first.close(keep_journal=True)
        with monkeypatch.context() as patch:
            full_disk(patch)
            second = await start(path, fresh=True)
            await second.close(keep_journal=True)
        third = await start(path)
        assert (third.news, call(third, "getParamNames", "/x")) == ([], [])
        await third.close()

    run(test())


def test_unreadable_journal_is_set_aside(path: Path) -> None:
    async def test() -> None:
        path.mkdir(parents=True)
        master = await start(path)
        copy = path.with_name("journal-1.damaged")
        assert "it cannot be read" in master.news[0]
        assert master.news[0].endswith(f"a copy is kept as {copy}")
        call(master, "setParam", "/a", "/p", 1)
        await master.close(keep_journal=True)
        assert path.is_file()
        assert copy.is_dir()

    run(test())


def test_journal_in_a_folder_that_cannot_exist_is_reported(tmp_path: Path) -> None:
    async def test() -> None:
        (tmp_path / "file").write_text("")
        master = await start(tmp_path / "file" / "journal")
        assert "no journal, a crash of the master would lose the graph" in master.news[0]
        assert call(master, "minirospy.status", "/x")["journal"].startswith("failing: ")
        await master.close()

    run(test())


def random_call(rng: random.Random) -> tuple[Any, ...]:
    node = f"/n{rng.randrange(4)}"
    uri = f"http://127.0.0.1:1/{rng.randrange(6) % 4}/"
    topic, key = f"/t{rng.randrange(4)}", rng.choice(["/p", "/p/a", "/p/a/b", "/q", "/"])
    value = rng.choice([1, "x", [1, {"z": 2}], {"a": {"b": 3}}, {}, 2.5])
    return rng.choice(
        [
            ("registerPublisher", node, topic, rng.choice(["a/B", "c/D", "*"]), uri),
            ("registerSubscriber", node, topic, rng.choice(["a/B", "*"]), uri),
            ("registerService", node, topic, f"rosrpc://x:{rng.randrange(3)}", uri),
            ("unregisterPublisher", node, topic, uri),
            ("unregisterSubscriber", node, topic, uri),
            ("unregisterService", node, topic, f"rosrpc://x:{rng.randrange(3)}"),
            ("setParam", node, key, value),
            ("setParam", node, key, value),
            ("deleteParam", node, key),
            ("subscribeParam", node, uri, key),
            ("unsubscribeParam", node, uri, key),
        ]
    )


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("compact", [300, 10**6], ids=["rewritten often", "appended"])
def test_journal_replays_to_the_same_state_after_any_calls(
    path: Path, seed: int, compact: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal_module, "COMPACT_BYTES", compact)
    monkeypatch.setattr(journal_module, "COMPACT_FACTOR", 1)

    async def test() -> None:
        rng = random.Random(seed)
        master = await start(path)
        master.notifier.send = lambda notice: None  # type: ignore[method-assign]
        for number in range(400):
            method, *args = random_call(rng)
            master.dispatch(method, args)
            # The response is serialized once, and again after each change, so clients receive the current tables.
            served = parse_response(serialize_response(master.serve("getSystemState", ["/x"])))
            assert served == master.dispatch("getSystemState", ["/x"])
            if number % 20 == 19:
                again = Master()
                replay = Replay(again.registry, again.parameters)
                for record in parse_journal(path.read_bytes()).records[1:]:
                    replay.apply(*record)
                assert state(again) == state(master)
        await master.close()

    run(test())


def test_interrupted_rewrite_leaves_the_old_file(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal = Journal(path, lambda: [["set", "/", {"a": 1}]])
    journal.start()
    assert not journal.trouble
    before = path.read_bytes()
    monkeypatch.setattr(journal_module.os, "replace", lambda *_: (_ for _ in ()).throw(OSError("no")))
    with pytest.raises(OSError, match="no"):
        journal.rewrite()
    assert path.read_bytes() == before
    assert before.startswith(HEAD)
    journal.close()


# --- kill -9, with a real process


class Killed:
    """A roscore that is killed and restarted on the same port, and two hundred fake nodes."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.uri = f"http://127.0.0.1:{port}/"
        self._opened: list[subprocess.Popen[bytes]] = []
        self.first = self.start()  # seconds until an empty master responded

    def start(self) -> float:
        """Start the master; return the seconds until it responds with its complete state."""
        self.process = self.open()
        try:
            return self.wait()
        except BaseException:
            self.end()
            raise

    def open(self) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [str(BIN / "roscore"), "-q", "-p", str(self.port)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )
        self._opened.append(process)
        return process

    def wait(self) -> float:
        start_time = time.monotonic()

        def answers() -> bool:
            with contextlib.suppress(OSError), ServerProxy(self.uri) as proxy:
                proxy.getPid("/test")
                return True
            return False

        wait_until(answers)
        return time.monotonic() - start_time

    def kill(self) -> float:
        """Kill and restart the master; return the seconds until it responds."""
        self.process.send_signal(signal.SIGKILL if sys.platform != "win32" else signal.SIGTERM)
        self.process.communicate()
        return self.start()

    def end(self) -> None:
        """Stop every running master, so that none remains after a failed test."""
        for process in self._opened:
            if process.poll() is None:
                process.terminate()
                try:
                    process.communicate(timeout=30)
                finally:
                    process.kill()
                    process.communicate()


class BackgroundClient:
    """A client of a master that runs in a thread and makes calls for the nodes at ``uris`` until :meth:`end`."""

    def __init__(self, master: str, uris: list[str]) -> None:
        self._master = master
        self._uris = uris
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def end(self) -> None:
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        raise NotImplementedError


class Registering(BackgroundClient):
    """A client that registers nodes and sets parameters, and records the acknowledged calls."""

    def __init__(self, master: str, uris: list[str]) -> None:
        self.answered: set[tuple[str, str, str]] = set()
        super().__init__(master, uris)

    def lasts(self, seconds: float, answers: int) -> bool:
        """Wait for this many more responses, and for this long after them; return whether the client is still running."""
        wanted = len(self.answered) + answers
        while len(self.answered) < wanted:
            if not self._thread.is_alive() or self._over.wait(0.01):
                return False
        return not self._over.wait(seconds)

    def _run(self) -> None:
        rng, number = random.Random(1), 0
        while not self._over.is_set():
            number += 1
            node = rng.randrange(len(self._uris))
            name, topic = f"/node{node}", f"/t{number % 1000}"
            with contextlib.suppress(OSError, Fault), ServerProxy(self._master) as proxy:
                for _ in range(5):
                    proxy.registerPublisher(name, topic, "std_msgs/Bool", self._uris[node])
                    self.answered.add(("pub", topic, name))
                    proxy.registerSubscriber(name, topic + "/in", "std_msgs/Bool", self._uris[node])
                    self.answered.add(("sub", topic + "/in", name))
                    proxy.setParam(name, f"/p/{name[1:]}", number)
                    self.answered.add(("par", f"/p/{name[1:]}", ""))


def known(master: str) -> set[tuple[str, str, str]]:
    with ServerProxy(master) as proxy:
        published, subscribed, _ = proxy.getSystemState("/test")[2]  # type: ignore[index,misc]
        parameters: Any = proxy.getParamNames("/test")[2]  # type: ignore[index]
    found = {("pub", topic, name) for topic, names in published for name in names}
    found |= {("sub", topic, name) for topic, names in subscribed for name in names}
    return found | {("par", key, "") for key in parameters}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no kill -9")
@pytest.mark.timeout(600)
def test_two_hundred_nodes_survive_their_master() -> None:
    """Set CRASHES=50 in the environment for a long test."""
    crashes = int(os.environ.get("CRASHES", "4"))
    loop, fakes = LoopThread("fakes"), Fakes()

    async def open_all() -> list[str]:
        return [await fakes.open() for _ in range(200)]

    master = Killed(free_port())
    client = Registering(master.uri, loop.run(open_all(), 20.0))
    rng, times = random.Random(2), []
    try:
        for _ in range(crashes):
            assert client.lasts(rng.uniform(0.2, 0.7), 20)
            before = set(client.answered)
            times.append(master.kill())
            assert not before - known(master.uri)
    finally:
        client.end()
        loop.run(fakes.close(), 20.0)
        loop.close()
        master.end()
    print(f"{crashes} crashes, {len(client.answered)} answers kept, back after {min(times):.2f} s or more")
    # Starting Python takes most of the time. Some starts take longer if the machine stalls.
    assert min(times) < 5 * master.first + 2.0, (times, master.first)


State = dict[tuple[str, ...], object]


class Oracle(BackgroundClient):
    """A client that changes the graph, and the state that a master must have after the acknowledged calls.

    While the lock is held, no call is in progress. A failed call may or may not have been executed: ``unsure`` is the state
    after it, and no further call is made until :meth:`settle` has compared both states with the master's.
    """

    def __init__(self, master: str, uris: list[str]) -> None:
        self.state: State = {}
        self.unsure: State | None = None
        self.acknowledged = 0
        self.lock = threading.Lock()
        super().__init__(master, uris)

    def lasts(self, calls: int) -> bool:
        """Wait until this many more calls are acknowledged; return False if that takes more than a minute."""
        wanted, end = self.acknowledged + calls, time.monotonic() + 60.0
        while self.acknowledged < wanted:
            if time.monotonic() > end or not self._thread.is_alive() or self._over.wait(0.01):
                return False
        return True

    def settle(self) -> None:
        """Assert that the master has the state of the acknowledged calls, with or without the failed one; continue from it.

        The caller holds the lock.
        """
        found = self.read()
        assert found in (self.state, self.unsure)
        self.state, self.unsure = found, None

    def read(self) -> State:
        """Return the master's state."""
        with ServerProxy(self._master) as proxy:
            published: Any = proxy.getSystemState("/test")[2]  # type: ignore[index]
            _, _, values = proxy.getParam("/test", "/oracle")  # type: ignore[misc]
        found: State = {
            ("publisher", topic, name): None
            for topic, names in published[0]
            for name in names
            if name != "/rosout"
        }
        return {**found, **{("parameter", key): value for key, value in (values or {}).items()}}

    def _run(self) -> None:
        rng = random.Random(1)
        while not self._over.is_set():
            # A broken connection is closed with its proxy.
            with contextlib.suppress(OSError, HTTPException), ServerProxy(self._master) as proxy:
                while not self._over.is_set():
                    with self.lock:
                        if self.unsure is None:
                            self._call(proxy, rng)
                    # Give a thread that waits for the lock a chance to acquire it.
                    time.sleep(0.0005)

    def _call(self, proxy: ServerProxy, rng: random.Random) -> None:
        node, topic = rng.randrange(len(self._uris)), f"/t{rng.randrange(50)}"
        name, uri = f"/node{node}", self._uris[node]
        key, number = f"k{rng.randrange(50)}", rng.randrange(2**31)
        after = dict(self.state)
        calls: list[Callable[[], Any]] = [
            lambda: proxy.registerPublisher(name, topic, "std_msgs/Bool", uri),
            lambda: proxy.unregisterPublisher(name, topic, uri),
            lambda: proxy.setParam(name, f"/oracle/{key}", number),
            lambda: proxy.deleteParam(name, f"/oracle/{key}"),
        ]
        what = rng.choice([0, 0, 1, 2, 2, 3])

        if what == 0:
            after["publisher", topic, name] = None
        elif what == 1:
            after.pop(("publisher", topic, name), None)
        elif what == 2:
            after["parameter", key] = number
        else:
            after.pop(("parameter", key), None)

        self.unsure = after
        calls[what]()
        self.state, self.unsure = after, None
        self.acknowledged += 1


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no kill -9")
@pytest.mark.timeout(1200)
def test_double_start_leaves_one_master_with_graph_and_journal() -> None:
    """Set CRASHES=50 in the environment for a long test."""
    crashes = int(os.environ.get("CRASHES", "2"))
    loop, fakes = LoopThread("fakes"), Fakes()

    async def open_all() -> list[str]:
        return [await fakes.open() for _ in range(20)]

    port = free_port()
    losers = 0
    with ExitStack() as stack:
        stack.callback(loop.close)
        stack.callback(lambda: loop.run(fakes.close(), 20.0))
        master = Killed(port)
        stack.callback(master.end)
        with ServerProxy(master.uri) as proxy:
            # Reading 20 MB takes so long that the two starts overlap.
            for number in range(10):
                proxy.setParam("/test", f"/large/{number}", [f"{number} " + 1000 * "x"] * 2000)
        oracle = Oracle(master.uri, loop.run(open_all(), 20.0))
        stack.callback(oracle.end)
        for _ in range(crashes):
            assert oracle.lasts(100)
            master.process.kill()
            with oracle.lock:
                both = [master.open(), master.open()]
                master.process.communicate()
                loser, survivor = first_to_end(both)
                losers += 1
                assert loser.returncode == 1
                assert b"another roscore/master is already running" in loser.communicate()[1]
                master.process = survivor
                master.wait()
                oracle.settle()
                with ServerProxy(master.uri) as proxy:
                    status: Any = proxy.minirospy.status("/test")
                    assert f"journal-{port} (" in status[2]["journal"]
                    names: Any = proxy.getParamNames("/test")[2]  # type: ignore[index]
                    assert sum(name.startswith("/large/") for name in names) == 10
    print(f"{losers} double starts, {oracle.acknowledged} acknowledged calls, no difference")


def first_to_end(processes: list[subprocess.Popen[bytes]]) -> list[subprocess.Popen[bytes]]:
    """Return the processes, starting with the one that has exited first."""
    wait_until(lambda: any(each.poll() is not None for each in processes))
    return sorted(processes, key=lambda each: each.poll() is None)
