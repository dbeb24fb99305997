"""runtime/master/notifier: nodes that do not respond share a few slots, and do not delay other nodes for long."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from minirospy.base.errors import RpcError, RpcUnreachable
from minirospy.core.graph.parameters import ParameterUpdate
from minirospy.core.graph.registry import NodeShutdown, PublisherUpdate
from minirospy.core.wire.xmlrpc import parse_call
from minirospy.runtime.master import notifier as notifier_module
from minirospy.runtime.master.notifier import Notifier
from minirospy.runtime.rpc.turns import Turns
from tests.manual_loop import ManualLoop, run_manually

ANSWER = b"<methodResponse/>"
DEAD = [f"http://dead{number}:1/" for number in range(6)]
ALIVE = [f"http://alive{number}:1/" for number in range(6)]


class Scene:
    """A notifier to whose calls the test responds."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(notifier_module, "MAX_CONCURRENT_CALLS", 4)
        monkeypatch.setattr(notifier_module, "CALLS_TO_SUSPECTS", 1)
        self.under_way: dict[str, Callable[[bytes | RpcError], None]] = {}
        self.bodies: list[tuple[str, bytes]] = []
        """The calls in order: the node's URI, and the request."""
        self.publishers: list[str] = []
        self.values: dict[str, object] = {}
        self.notifier = Notifier(self, Turns(), timeout=3.0)  # type: ignore[arg-type]
        monkeypatch.setattr(self.notifier.rpc, "start", self.start)

    def publisher_uris(self, topic: str) -> list[str]:
        return list(self.publishers)

    def parameter(self, key: str) -> object:
        return self.values.get(key, {})

    def subscribed_parameters(self, uri: str) -> list[str]:
        return ["/all/"]

    @property
    def calls(self) -> list[tuple[str, list[object]]]:
        """The method and arguments of each call."""
        return [(call.method, call.args) for call in (parse_call(body) for _, body in self.bodies)]

    def start(
        self, uri: str, body: bytes | list[bytes], timeout: float, done: Callable[[bytes | RpcError], None]
    ) -> None:
        assert uri not in self.under_way, "a node is called once at a time"
        self.bodies.append((uri, body if isinstance(body, bytes) else b"".join(body)))
        self.under_way[uri] = done

    def notify(self, uris: list[str], topic: str) -> None:
        for uri in uris:
            self.notifier.send(PublisherUpdate(uri, topic))

    async def answer(self, clock: ManualLoop, uris: list[str], *, is_dead: bool) -> None:
        """Respond to all calls to ``uris``, one after the other, as they arrive."""
        left = set(uris)
        while left:
            await clock.advance(0.01)
            now = left & self.under_way.keys()
            assert now
            for uri in now:
                self.under_way.pop(uri)(RpcUnreachable(uri, "timed out") if is_dead else ANSWER)
            left -= now


def test_nodes_that_did_not_answer_have_few_slots_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        scene.notify(DEAD, "/t")
        await clock.advance(0.01)
        assert len(scene.under_way) == 4
        await scene.answer(clock, DEAD, is_dead=True)

        scene.notify(DEAD, "/t2")
        await clock.advance(0.01)
        assert list(scene.under_way) == DEAD[:1]
        scene.notify(ALIVE, "/t2")
        await clock.advance(0.01)
        assert list(scene.under_way) == [DEAD[0], *ALIVE[:4]]
        await scene.answer(clock, ALIVE, is_dead=False)
        await scene.notifier.close()

    run_manually(scene)


def test_a_node_that_answers_again_has_a_full_share_again(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        scene.notify(DEAD, "/t")
        await scene.answer(clock, DEAD, is_dead=True)
        scene.notify(DEAD, "/t2")
        await scene.answer(clock, DEAD, is_dead=False)

        scene.notify(DEAD, "/t3")
        await clock.advance(0.01)
        assert list(scene.under_way) == DEAD[:4]
        await scene.notifier.close()

    run_manually(scene)


NODE = "http://node:1/"


def test_each_kind_of_notice_is_a_call_of_the_slave_api(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        scene.publishers, scene.values = ["http://a:1/"], {"/p/": 5}
        for notice in (
            PublisherUpdate("http://one:1/", "/t"),
            ParameterUpdate("http://two:1/", "/p/"),
            NodeShutdown("http://three:1/", "/n", "new node registered with same name"),
        ):
            scene.notifier.send(notice)
        assert not scene.bodies, "who registers gets its answer first"
        await clock.advance(0.01)
        assert scene.calls == [
            ("publisherUpdate", ["/master", "/t", ["http://a:1/"]]),
            ("paramUpdate", ["/master", "/p/", 5]),
            ("shutdown", ["/master", "[/n] Reason: new node registered with same name"]),
        ]
        await scene.notifier.close()

    run_manually(scene)


def test_a_node_gets_the_newest_list_of_a_topic_once(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        scene.notify([NODE], "/t")
        await clock.advance(0.01)
        for number in range(3):
            # This happens during the first call.
            scene.publishers = [f"http://publisher{number}:1/"]
            scene.notify([NODE], "/t")
            await clock.advance(0.01)
        assert len(scene.bodies) == 1

        await scene.answer(clock, [NODE], is_dead=False)
        await clock.advance(0.01)
        assert scene.calls[1:] == [("publisherUpdate", ["/master", "/t", ["http://publisher2:1/"]])]
        await scene.notifier.close()

    run_manually(scene)


def test_notices_of_one_node_keep_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        for topic in ("/c", "/a", "/b"):
            scene.notify([NODE], topic)
        for _ in range(3):
            await scene.answer(clock, [NODE], is_dead=False)
        assert [args[1] for _, args in scene.calls] == ["/c", "/a", "/b"]
        await scene.notifier.close()

    run_manually(scene)


def test_many_parameters_become_one_notice_for_each_subscription(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notifier_module, "MAX_PARAMETERS", 3)

    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        for number in range(4):
            scene.notifier.send(ParameterUpdate(NODE, f"/all/{number}/"))
        await scene.answer(clock, [NODE], is_dead=False)
        await clock.advance(1.0)
        assert scene.calls == [("paramUpdate", ["/master", "/all/", {}])]
        await scene.notifier.close()

    run_manually(scene)


def test_a_node_of_this_loop_is_not_called_by_a_socket(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene, taken = Scene(monkeypatch), list[tuple[str, list[str]]]()
        scene.publishers = ["http://a:1/"]
        scene.notifier.here[NODE] = lambda topic, publishers: taken.append((topic, publishers))
        scene.notify([NODE], "/rosout")
        await clock.advance(0.01)
        assert (taken, scene.bodies) == ([("/rosout", ["http://a:1/"])], [])
        await scene.notifier.close()

    run_manually(scene)


def test_nothing_is_sent_after_close(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        scene.notify([NODE], "/t")
        await scene.notifier.close()
        await clock.advance(1.0)
        assert not scene.bodies

    run_manually(scene)


def test_updates_of_many_publishers_are_rate_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a list of 1,000 publishers there is a pause of 50 ms; it does not delay the node's other topics."""

    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        (uri,) = ALIVE[:1]
        lists = {"/many": ["http://x:1/"] * 1000, "/few": ["http://x:1/"]}
        monkeypatch.setattr(scene, "publisher_uris", lambda topic: list(lists[topic]))
        scene.notify([uri], "/many")
        await scene.answer(clock, [uri], is_dead=False)

        for _ in range(5):
            scene.notify([uri], "/many")
        scene.notify([uri], "/few")
        await scene.answer(clock, [uri], is_dead=False)
        await clock.advance(0.03)
        assert [args[1] for _, args in scene.calls] == ["/many", "/few"]

        await clock.advance(0.02)
        await scene.answer(clock, [uri], is_dead=False)
        assert [args[1] for _, args in scene.calls] == ["/many", "/few", "/many"]
        # After its pause, a node uses neither memory nor time.
        await clock.advance(0.06)
        assert not scene.notifier.nodes
        await scene.notifier.close()

    run_manually(scene)


def test_an_update_that_waited_lists_later_publishers_too(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        one, other = ALIVE[:2]
        scene.publishers = ["http://x:1/"] * 300
        scene.notify([one], "/many")
        await scene.answer(clock, [one], is_dead=False)

        # This node's topic pauses for 15 ms, during which a publisher registers.
        scene.notify([one, other], "/many")
        await scene.answer(clock, [other], is_dead=False)
        scene.publishers.append("http://x:2/")
        await scene.answer(clock, [one], is_dead=False)
        lists = [args[2] for _, args in scene.calls]
        assert [len(each) for each in lists if isinstance(each, list)] == [300, 300, 301]
        await scene.notifier.close()

    run_manually(scene)


def test_a_node_on_the_loop_is_notified_without_a_call(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        (uri,) = ALIVE[:1]
        received: list[tuple[str, int]] = []
        monkeypatch.setattr(
            scene, "publisher_uris", lambda topic: ["http://x:1/"] * (1000 if topic == "/many" else 1)
        )
        scene.notifier.here[uri] = lambda topic, uris: received.append((topic, len(uris)))
        for topic in ("/many", "/few", "/few", "/many"):
            scene.notify([uri], topic)
        await clock.advance(0.0)
        assert received == [("/many", 1000), ("/few", 1)]

        scene.notify([uri], "/many")
        await clock.advance(0.04)
        assert len(received) == 2
        await clock.advance(0.02)
        assert received[2:] == [("/many", 1000)]
        await clock.advance(0.06)
        assert not scene.notifier.nodes
        assert not scene.under_way
        assert not scene.notifier.line.under_way
        await scene.notifier.close()

    run_manually(scene)
