"""Failures, false data and floods in a fleet; each has the result that docs/fleet.md describes."""

from __future__ import annotations

import asyncio
import importlib
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Image
from std_msgs.msg import Int64, String

from minirospy.base.errors import BridgeError, ServiceException
from minirospy.base.installation import install_command
from minirospy.fleet.gateway import Gateway
from minirospy.fleet.importer import Importer
from minirospy.fleet.inquiry import fleet_status
from minirospy.fleet.keys import ROOT, in_key
from minirospy.fleet.network import FleetNetwork, NetworkOptions
from minirospy.fleet.rules import GatewayRules, parse_rates
from tests.conftest import free_port
from tests.fleet.fleet import SECONDS, Fleet, Place
from tests.fleet.test_fleet_gateways import collect, fleet, publisher
from tests.waiting import until

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

__all__ = ["fleet"]


class Proxy:
    """A TCP proxy that can stop forwarding bytes without closing connections, like an interrupted link."""

    def __init__(self, fleet: Fleet, to: str) -> None:
        self._fleet = fleet
        self._to = int(to.rpartition(":")[2])
        self._open = asyncio.Event()
        self._open.set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._server = fleet.run(self._start())
        self.endpoint = f"tcp/127.0.0.1:{self._server.sockets[0].getsockname()[1]}"

    def cut(self) -> None:
        self._fleet.call(self._open.clear)

    def mend(self) -> None:
        self._fleet.call(self._open.set)

    async def close(self) -> None:
        self._server.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _start(self) -> Any:
        return await asyncio.start_server(self._accept, "127.0.0.1", 0)

    async def _accept(self, reader: Any, writer: Any) -> None:
        try:
            reader2, writer2 = await asyncio.open_connection("127.0.0.1", self._to)
        except OSError:
            writer.close()
            return
        for one, other in ((reader, writer2), (reader2, writer)):
            task = asyncio.ensure_future(self._pass(one, other))
            self._tasks.add(task)

    async def _pass(self, reader: Any, writer: Any) -> None:
        try:
            while data := await reader.read(1 << 16):
                await self._open.wait()
                writer.write(data)
                await writer.drain()
        except OSError:
            pass
        finally:
            writer.close()


@pytest.fixture
def quick(tmp_path: Path) -> str:
    """Return a Zenoh configuration in which a link without traffic for two seconds is lost."""
    file = tmp_path / "quick.json5"
    file.write_text("{ transport: { link: { tx: { lease: 2000 } } } } // of a test")
    return str(file)


def gateway_of(place: Place, name: str, network: NetworkOptions) -> Gateway:
    from minirospy.fleet.gateway import GatewayOptions

    gateway = Gateway(
        place.node(f"fleet_{name or 'control'}"), GatewayOptions(name, imports=not name, network=network)
    )
    place.fleet.gateways.append(gateway)
    place.fleet.run(gateway.start())
    return gateway


def test_a_gateway_that_ends_takes_its_robot_away_until_it_is_back(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    strings = publisher(fleet, robot, "/chat", String)
    control.gateway(listens=True)
    gateway = robot.gateway("robot1")
    found = collect(fleet, control, "/robot1/chat", String)
    fleet.run(strings.wait_for_subscribers(1, SECONDS))
    fleet.stop(gateway)
    fleet.until(lambda: fleet.gateways[0].importer.robots == {})  # type: ignore[union-attr]

    async def is_gone() -> bool:
        return "/robot1/chat" not in {topic for topic, _ in (await control.fetch_state())[0]}

    fleet.until(is_gone)

    fleet.until(lambda: not strings.num_connections)
    robot.gateway("robot1")
    fleet.run(strings.wait_for_subscribers(1, SECONDS))
    fleet.run(strings.publish("again"))
    fleet.until(lambda: [each.data for each in found] == ["again"])


def test_a_router_that_is_lost_and_comes_back(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    strings = publisher(fleet, robot, "/chat", String)
    options = NetworkOptions(listen=(fleet.endpoint,))
    router = fleet.run(FleetNetwork.open(options))
    try:
        importer = control.gateway().importer
        robot.gateway("robot1")
        found = collect(fleet, control, "/robot1/chat", String)
        fleet.run(strings.wait_for_subscribers(1, SECONDS))
        fleet.run(router.close())
        assert importer is not None
        fleet.until(lambda: not importer.robots)
        router = fleet.run(FleetNetwork.open(options))
        fleet.until_shown(control, "/robot1/chat")
        fleet.run(strings.wait_for_subscribers(1, SECONDS))

        async def is_received() -> bool:
            await strings.publish("again")
            return bool(found)

        fleet.until(is_received)
    finally:
        fleet.run(router.close())


def test_a_link_that_is_cut_is_noticed_and_mended(fleet: Fleet, quick: str) -> None:
    robot, control = fleet.place(), fleet.place()
    strings = publisher(fleet, robot, "/map", String, latch=True)
    fleet.run(strings.publish("the map"))
    importer = gateway_of(control, "", NetworkOptions(listen=(fleet.endpoint,), config=quick)).importer
    assert importer is not None
    proxy = Proxy(fleet, fleet.endpoint)
    try:
        gateway_of(robot, "robot1", NetworkOptions(connect=(proxy.endpoint,), config=quick))
        found = collect(fleet, control, "/robot1/map", String)
        # A machine that stalls for two seconds also loses the link.
        fleet.until(lambda: len(found) >= 1)

        proxy.cut()
        fleet.until(lambda: not importer.robots)
        count = len(found)
        proxy.mend()
        # The subscriber receives the latched message again, as from a restarted publisher.
        fleet.until(lambda: len(found) > count)
    finally:
        fleet.run(proxy.close())


async def _answers(importer: Importer) -> bool:
    return set(await importer._answering() or ()) >= importer.contents.gateways


def serve_never(fleet: Fleet, robot: Any) -> asyncio.Event:
    """Offer /slow (std_srvs/Trigger) on a robot, which never responds; return the event of its first call."""
    from std_srvs.srv import Trigger

    called = asyncio.Event()

    async def never(_: object) -> None:
        called.set()
        await asyncio.Event().wait()

    node = robot.node("slow")

    async def serving() -> None:
        await node.serve("/slow", Trigger, never)

    fleet.run(serving())
    return called


async def call_never(client: Any, called: asyncio.Event) -> asyncio.Future[Any]:
    """Return a call to /robot1/slow that has arrived; repeat calls that fail before that because the machine has stalled."""
    from std_srvs.srv import Trigger

    while True:
        await client.wait_for_service("/robot1/slow", SECONDS)
        calling = asyncio.ensure_future(client.call("/robot1/slow", Trigger))
        arriving = asyncio.ensure_future(called.wait())
        await asyncio.wait({calling, arriving}, return_when=asyncio.FIRST_COMPLETED)
        arriving.cancel()
        if called.is_set():
            return calling
        assert isinstance(calling.exception(), ServiceException)


def test_a_robot_that_is_silent_leaves_though_zenoh_keeps_its_tokens(
    fleet: Fleet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("presence.REGULAR_SECONDS", "presence.LOST_SECONDS", "presence.ROUND_SECONDS"):
        monkeypatch.setattr(f"minirospy.fleet.{name}", 0.2)
    monkeypatch.setattr("minirospy.fleet.importer.PING_SECONDS", 1.0)
    slow = tmp_path / "slow.json5"
    slow.write_text("{ transport: { link: { tx: { lease: 600000 } } } }")
    robot, control = fleet.place(), fleet.place()
    called = serve_never(fleet, robot)
    network = NetworkOptions(listen=(fleet.endpoint,), config=str(slow))
    importer = gateway_of(control, "", network).importer
    assert importer is not None
    proxy = Proxy(fleet, fleet.endpoint)
    try:
        gateway_of(robot, "robot1", NetworkOptions(connect=(proxy.endpoint,), config=str(slow)))
        client = control.node("client")
        fleet.until(lambda: importer._presence._answered)
        # All gateways are queried with one key expression, and each replies under its own key.
        fleet.until(partial(_answers, importer))

        async def call() -> str:
            calling = await call_never(client, called)
            proxy._open.clear()
            try:
                await calling
            except ServiceException as error:
                return str(error)
            return ""

        assert "robot [robot1] has left during the call" in fleet.run(call())
        fleet.until(lambda: not importer.robots)
        assert importer.contents.robots()
        proxy.mend()
        fleet.until(lambda: importer.robots)
        fleet.run(client.wait_for_service("/robot1/slow", SECONDS))
    finally:
        fleet.run(proxy.close())


def test_a_call_ends_when_the_robot_is_lost(fleet: Fleet, quick: str) -> None:
    robot, control = fleet.place(), fleet.place()
    called = serve_never(fleet, robot)
    gateway_of(control, "", NetworkOptions(listen=(fleet.endpoint,), config=quick))
    gateway = gateway_of(robot, "robot1", NetworkOptions(connect=(fleet.endpoint,), config=quick))
    client = control.node("client")

    async def call() -> str:
        calling = await call_never(client, called)
        fleet.gateways.remove(gateway)
        await gateway.close()
        try:
            await calling
        except ServiceException as error:
            return str(error)
        return ""

    assert "robot1" in fleet.run(call())


def test_a_clock_that_differs_is_measured(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    numbers = publisher(fleet, robot, "/count", Int64)
    importer = control.gateway(listens=True).importer
    assert importer is not None
    robot.gateway("robot1", clock=lambda: time.time_ns() + 3_600_000_000_000)
    collect(fleet, control, "/robot1/count", Int64)
    fleet.run(numbers.wait_for_subscribers(1, SECONDS))
    fleet.until(lambda: importer.robots["robot1"].clock)
    shown = importer.robots["robot1"]
    assert shown.clock is not None
    assert abs(shown.clock.offset - 3_600_000_000_000) <= shown.clock.round_trip

    fleet.run(numbers.publish(1))
    fleet.until(lambda: shown.topics["/count"].delay.count)
    assert shown.topics["/count"].delay.longest < 60_000_000_000


def test_a_robot_that_floods_does_not_stop_another(fleet: Fleet) -> None:
    wild, calm, control = fleet.place(), fleet.place(), fleet.place()
    images = publisher(fleet, wild, "/image", Image, queue_size=2)
    numbers = publisher(fleet, calm, "/count", Int64)
    importer = control.gateway(listens=True).importer
    assert importer is not None
    wild.gateway("wild")
    calm.gateway("calm")
    seen = collect(fleet, control, "/wild/image", Image, "viewer")
    found = collect(fleet, control, "/calm/count", Int64)
    fleet.run(images.wait_for_subscribers(1, SECONDS))
    fleet.run(numbers.wait_for_subscribers(1, SECONDS))
    image = Image(data=bytes(300_000))

    async def both() -> None:
        for number in range(50):
            for _ in range(10):
                await images.publish(image)
            await numbers.publish(number)
            await asyncio.sleep(0.005)

    fleet.run(both())
    fleet.until(lambda: len(found) == 50)
    assert [each.data for each in found] == list(range(50))
    assert len(seen) <= 500


def test_a_rate_limit_holds_back_at_the_robot(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    numbers = publisher(fleet, robot, "/count", Int64)
    control.gateway(listens=True)
    gateway = robot.gateway("robot1", rules=GatewayRules(rates=parse_rates(["/count=0.01"])))
    found = collect(fleet, control, "/robot1/count", Int64)
    fleet.run(numbers.wait_for_subscribers(1, SECONDS))

    async def publish() -> None:
        for number in range(20):
            await numbers.publish(number)

    fleet.run(publish())
    assert gateway.exporter is not None
    outflow = gateway.exporter.outbound["/count"].outflow
    fleet.until(lambda: outflow.throttled == 19)
    fleet.until(lambda: found)
    assert [each.data for each in found] == [0]


def test_malformed_items_are_left_out(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    found = collect(fleet, robot, "/chat", String)
    secret = collect(fleet, robot, "/secret", String, "other")
    importer = control.gateway(listens=True).importer
    assert importer is not None
    gateway = robot.gateway("robot1", rules=GatewayRules(topics=lambda name: name == "/chat"))  # type: ignore[arg-type]
    fleet.until_shown(control, "/robot1/chat")
    stranger = fleet.run(FleetNetwork.open(NetworkOptions(connect=(fleet.endpoint,))))
    try:
        md5 = String._md5sum
        fleet.call(
            lambda: [
                stranger.declare_token(f"{ROOT}/{key}")
                for key in ("robot/1/x/y/z", "topic/a", "robot/evil/x/y", "service/robot1/a/b/c/d")
            ]
        )
        ends = ("robot1", gateway.id)
        for key, body in (
            (in_key(*ends, md5, "/secret", "0" * 16), b"\3\0\0\0abc"),
            (in_key(*ends, "0" * 32, "/chat", "0" * 16), b"\3\0\0\0abc"),
            (in_key(*ends, md5, "/unknown", "0" * 16), b"\3\0\0\0abc"),
            (f"{ROOT}/in/robot1/{gateway.id}/nonsense", b""),
            (in_key(*ends, md5, "/chat", "0" * 16), b"\3\0\0\0abc"),
        ):
            stranger._session.put(key, body)  # type: ignore[attr-defined]
        fleet.until(lambda: found)
        assert [each.data for each in found] == ["abc"]
        assert secret == []
        fleet.until(lambda: importer.contents.refused >= 4)
        assert list(importer.robots) == ["robot1"]
        status = fleet.run(fleet_status(stranger, SECONDS))
        assert status[0][0].status["topics"] == 1
    finally:
        fleet.run(stranger.close())


def test_a_user_without_the_password_is_refused(
    fleet: Fleet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "users.txt").write_text("robot1:right\n")

    def config(name: str, user: dict[str, str]) -> str:
        file = tmp_path / f"{name}.json5"
        file.write_text(json.dumps({"transport": {"auth": {"usrpwd": user}}}))
        return str(file)

    server = config(
        "server", {"user": "control", "password": "x", "dictionary_file": str(tmp_path / "users.txt")}
    )
    control, robot = fleet.place(), fleet.place()
    publisher(fleet, robot, "/chat", String)
    gateway_of(control, "", NetworkOptions(listen=(fleet.endpoint,), config=server))
    wrong = config("wrong", {"user": "robot1", "password": "wrong"})
    with monkeypatch.context() as patch:
        patch.setattr("minirospy.zenoh.library.CONNECT_MS", 1000)
        with pytest.raises(BridgeError):
            fleet.run(FleetNetwork.open(NetworkOptions(connect=(fleet.endpoint,), config=wrong), waits=False))
    right = config("right", {"user": "robot1", "password": "right"})
    gateway_of(robot, "robot1", NetworkOptions(connect=(fleet.endpoint,), config=right))
    fleet.until_shown(control, "/robot1/chat")


def test_nothing_listens_without_a_word(fleet: Fleet, quick: str) -> None:
    import psutil

    def ports() -> set[tuple[str, int]]:
        return {
            each.laddr
            for each in psutil.Process().net_connections(kind="inet")
            if each.status == "LISTEN" or each.type == 2
        }

    router = fleet.run(FleetNetwork.open(NetworkOptions(listen=(fleet.endpoint,))))
    before = ports()
    for options in (NetworkOptions((fleet.endpoint,)), NetworkOptions((fleet.endpoint,), config=quick)):
        session = fleet.run(FleetNetwork.open(options))
        assert ports() == before
        fleet.run(session.close())
    fleet.run(router.close())


@pytest.mark.parametrize(
    ("text", "error"),
    [("{", "--config .*bad.json5: "), ('{ mode: "nonsense" }', "--config .*bad.json5: ")],
)
def test_a_bad_configuration_is_one_line(fleet: Fleet, tmp_path: Path, text: str, error: str) -> None:
    file = tmp_path / "bad.json5"
    file.write_text(text)
    with pytest.raises(BridgeError, match=error) as caught:
        fleet.run(FleetNetwork.open(NetworkOptions(config=str(file))))
    assert "\n" not in str(caught.value)


# --- processes


@pytest.fixture
def start() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Return a function that starts `minirospy fleet`; stop the processes after the test."""
    running: list[subprocess.Popen[str]] = []

    def starting(*words: str, **environ: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-m", "minirospy", "fleet", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, **environ},
        )
        running.append(process)
        return process

    yield starting
    for process in running:
        process.kill()
        process.communicate()


def ended(process: subprocess.Popen[str]) -> tuple[int, str]:
    text, _ = process.communicate(timeout=SECONDS)
    return process.returncode, text


def answered(start: Callable[..., subprocess.Popen[str]], *words: str) -> tuple[int, str]:
    """Return the status and output of a command that has reached the fleet.

    Repeat the command, because on a busy machine, connecting may take longer than it waits.
    """
    while True:
        code, text = ended(start(*words))
        if "nothing of the fleet answers" not in text and "no answer" not in text:
            return code, text


def test_the_commands_from_start_to_kill(fleet: Fleet, start: Callable[..., subprocess.Popen[str]]) -> None:
    robot, control = fleet.place(), fleet.place()
    publisher(fleet, robot, "/chat", String)
    endpoint = f"127.0.0.1:{free_port()}"
    # Start the gateways before their router.
    gateway = start("gateway", "--name", "robot1", "--connect", endpoint, ROS_MASTER_URI=robot.uri)
    room = start("control", "--connect", endpoint, ROS_MASTER_URI=control.uri)
    router = start("router", "--listen", endpoint)
    assert router.stdout is not None
    assert router.stdout.readline() == f"router of the fleet at tcp/{endpoint}\n"
    fleet.until_shown(control, "/robot1/chat")

    code, text = answered(start, "status", "--seconds", "60", "--connect", endpoint)
    assert code == 0
    assert text.startswith("1 robot, 1 control room\nrobot1 (")
    assert "1 topic, 0 services, clock " in text
    fleet.run(robot.nodes[0].set_param("/speed", 1.5))
    assert answered(start, "param", "robot1", "/speed", "--connect", endpoint) == (0, "1.5\n")
    code, text = answered(start, "param", "robot1", "/nothing", "--connect", endpoint)
    assert (code, text) == (1, "minirospy fleet: ERROR: robot [robot1]: Parameter [/nothing] is not set\n")

    gateway.kill()

    async def is_gone() -> bool:
        return "/robot1/chat" not in {topic for topic, _ in (await control.fetch_state())[0]}

    fleet.until(is_gone)
    for process in (room, router):
        process.send_signal(signal.SIGTERM if sys.platform == "win32" else signal.SIGINT)
    if sys.platform != "win32":
        assert ended(room)[0] == 0
        assert ended(router)[0] == 0


@pytest.mark.parametrize(
    ("words", "code", "error"),
    [
        (("gateway", "--name", "1robot"), 1, "[1robot] cannot be a robot's name"),
        (("gateway", "--rate", "/scan=fast"), 1, "--rate /scan=fast: [fast] is not a rate in Hz"),
        (("control", "--priority", "/scan=high"), 1, "[high] is not one of teleop, data, bulk"),
        (("status", "--connect", "127.0.0.1:1"), 1, "nothing of the fleet answers at tcp/127.0.0.1:1"),
        (("status", "--seconds", "0"), 2, "--seconds 0 is not between 0.1 and 60"),
        (("router", "--listen", "nonsense/x"), 2, "minirospy fleet: ERROR: [nonsense/x] is not an endpoint"),
        (
            ("gateway", "--name", "robot1", "--connect", "host:99999"),
            2,
            "[tcp/host:99999] has the port 99999",
        ),
        (("control", "--connect", "http://host"), 2, "[http://host] is not an endpoint: give HOST"),
        (("status", "--connect", "no-such-host.invalid"), 1, "(no-such-host.invalid does not resolve)"),
        (("control", "--config", "nothing.json5"), 1, "--config nothing.json5: there is no such file"),
    ],
)
def test_usage_errors_are_one_line(
    master: str,
    words: tuple[str, ...],
    code: int,
    error: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    from minirospy.cli.fleet import main

    # Nothing can answer at these addresses.
    monkeypatch.setattr("minirospy.zenoh.library.CONNECT_MS", 50)
    try:
        found = main(words)
    except SystemExit as ended:  # argparse exits this way
        found = ended.code  # type: ignore[assignment]
    assert found == code
    text = capsys.readouterr()
    assert error in text.out + text.err
    assert "Traceback" not in text.out + text.err


def test_a_name_that_does_not_resolve_yet_is_named_once(
    fleet: Fleet, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("minirospy.fleet.network.RETRY_SECONDS", 0.05)
    monkeypatch.setattr("minirospy.zenoh.library.CONNECT_MS", 50)
    looks: list[object] = []

    def unresolved(_: object) -> list[str]:
        looks.append(1)
        return ["robot.local"]

    monkeypatch.setattr("minirospy.fleet.network.unresolved", unresolved)

    async def opening() -> None:
        task = asyncio.ensure_future(FleetNetwork.open(NetworkOptions(connect=(fleet.endpoint,))))
        await until(lambda: len(looks) >= 3)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    fleet.run(opening())
    assert [record.getMessage() for record in caplog.records] == [
        f"nothing of the fleet answers at {fleet.endpoint} yet (robot.local does not resolve). Will keep trying."
    ]


def test_local_process_connects_to_no_other_host(
    master: str, start: Callable[..., subprocess.Popen[str]]
) -> None:
    for words in (("control", "--listen", "0.0.0.0"), ("control", "--scout")):
        code, text = ended(start(*words, MINIROSPY_LOCAL="1"))
        assert code == 2
        assert "MINIROSPY_LOCAL=1 keeps all on this machine" in text


def test_the_missing_library_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from minirospy.cli.fleet import main

    def missing(name: str, *_: object) -> object:
        if name.partition(".")[0] == "zenoh":
            raise ImportError(name=name)
        return found(name)

    found = importlib.import_module
    monkeypatch.setattr("minirospy.fleet.network.importlib.import_module", missing)
    assert main(["status"]) == 1
    assert install_command("minirospy[fleet]", upgrade=True) in capsys.readouterr().err


def until_line(process: subprocess.Popen[str], text: str) -> str:
    """Return the first line of a process that contains a text."""
    assert process.stdout is not None
    for line in process.stdout:
        if text in line:
            return line
    raise AssertionError(f"the process ended without [{text}]")


@pytest.mark.parametrize("words", [("control",), ("gateway", "--name", "robot1")])
def test_a_second_start_that_cannot_listen_or_waits_does_not_end_the_first(
    master: str, start: Callable[..., subprocess.Popen[str]], words: tuple[str, ...]
) -> None:
    endpoint = f"127.0.0.1:{free_port()}"
    running = start(*words, "--listen", endpoint)
    until_line(running, "(gateway ")
    # A gateway that still waits for its router has not claimed the name.
    router = f"127.0.0.1:{free_port()}"
    waiting = start(*words, "--connect", router)
    wrong = [
        start(*words, "--listen", listen) for listen in (endpoint, "192.0.2.1:7447", "no-such-host.invalid")
    ]
    for code, text in map(ended, wrong):
        assert code == 1
        assert "the fleet's network cannot be opened" in text
        assert "Traceback" not in text
    assert waiting.stdout is not None
    assert f"nothing of the fleet answers at tcp/{router} yet" in waiting.stdout.readline()
    waiting.send_signal(signal.SIGTERM)
    assert ended(waiting)[0] == (1 if sys.platform == "win32" else 0)
    assert running.poll() is None

    # A gateway that is connected claims the name, and the first one prints why it exits.
    start(*words, "--listen", f"127.0.0.1:{free_port()}")
    assert until_line(running, "shutdown request").endswith("new node registered with same name\n")
    assert ended(running)[0] == 0


def test_robot_stops_if_commands_stop_arriving(fleet: Fleet) -> None:
    """The link is cut, and the event loop of the robot's gateway is blocked. Zero velocity must be published regardless."""
    robot, control = fleet.place(), fleet.place()
    control.gateway(listens=True)
    proxy = Proxy(fleet, fleet.endpoint)
    gateway = robot.gateway("robot1", endpoint=proxy.endpoint)
    assert gateway.exporter
    inbound = gateway.exporter.inbound
    base = RawSubscriber()
    try:
        collect(fleet, robot, "/cmd_vel", Twist)
        fleet.until_shown(control, "/robot1/cmd_vel")
        commands = publisher(fleet, control, "/robot1/cmd_vel", Twist)
        fleet.run(commands.wait_for_subscribers(1, SECONDS))
        message = Twist()
        message.linear.x = 0.5
        driving = threading.Event()

        async def drive() -> None:
            while not driving.is_set():
                await commands.publish(message)
                await asyncio.sleep(0.02)

        task = fleet.call(lambda: asyncio.ensure_future(drive()))
        fleet.until(lambda: "/cmd_vel" in inbound and inbound["/cmd_vel"].passed > 2)
        base.connect(gateway.node.uri)
        base.until(lambda twist: twist.linear.x == 0.5)
        base.until(lambda twist: twist.linear.x == 0.5)
        released, blocked = threading.Event(), threading.Event()

        def block() -> None:
            blocked.set()
            released.wait()

        # All event loops in the test run in this thread, whereas the receiver and the guard have their own threads.
        proxy.cut()
        fleet.loop.loop.call_soon_threadsafe(block)
        try:
            assert blocked.wait(SECONDS)
            base.until(lambda twist: twist.linear.x == 0.0)
        finally:
            driving.set()
            released.set()
        fleet.run(asyncio.wait_for(task, SECONDS))
    finally:
        base.close()
        proxy.mend()
        fleet.run(proxy.close())


class RawSubscriber:
    """A robot's base without an event loop: a subscriber to /cmd_vel, with raw XML-RPC and TCPROS."""

    def __init__(self) -> None:
        self._socket: socket.socket | None = None

    def connect(self, uri: str) -> None:
        with ServerProxy(uri) as node:
            answer: Any = node.requestTopic("/base", "/cmd_vel", [["TCPROS"]])
        self._socket = socket.create_connection((answer[2][1], answer[2][2]), SECONDS)
        fields = {"callerid": "/base", "topic": "/cmd_vel", "type": Twist._type, "md5sum": Twist._md5sum}
        parts = [f"{name}={value}".encode() for name, value in fields.items()]
        header = b"".join(struct.pack("<I", len(part)) + part for part in parts)
        self._socket.sendall(struct.pack("<I", len(header)) + header)
        self._frame()

    def until(self, is_right: Callable[[Twist], bool]) -> None:
        while not is_right(Twist().deserialize(self._frame())):
            pass

    def close(self) -> None:
        if self._socket:
            self._socket.close()

    def _frame(self) -> bytes:
        return self._exactly(struct.unpack("<I", self._exactly(4))[0])

    def _exactly(self, size: int) -> bytes:
        assert self._socket
        data = b""
        while len(data) < size:
            more = self._socket.recv(size - len(data))
            assert more
            data += more
        return data
