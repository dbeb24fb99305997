"""The control room half of a gateway. Shows each robot in the local graph, in a namespace of the same name."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING

from minirospy.aio.raw import RawService
from minirospy.aio.tasks import ErrorReporter, keep_running
from minirospy.base.errors import MasterUnreachableError, RpcError, ServiceException
from minirospy.base.heap import return_free_memory
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.fleet.clocks import ClockOffset, Ping, offset_of
from minirospy.fleet.contents import FleetContents, Refused, Robot
from minirospy.fleet.definitions import Definitions
from minirospy.fleet.holders import HOLD_SECONDS, parse_machines
from minirospy.fleet.imported_topic import ImportedTopic, Shared
from minirospy.fleet.keys import ROOT, Claim, ServiceToken, call_key, parse_claim
from minirospy.fleet.network import Deferred, FleetNetwork, QueryFailed
from minirospy.fleet.presence import Presence
from minirospy.fleet.rules import GatewayRules
from minirospy.fleet.sender import Receiver, Sender
from minirospy.introspect.snapshot import Snapshot, fetch
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["MACHINES", "ImportedRobot", "Importer"]

MACHINES = "/fleet/machines"
"""The parameter with the machines chosen by the operator, keyed by robot; set by `minirospy fleet takeover`."""

_log = logging.getLogger(__name__)
_SETTLE_SECONDS = 0.1
LOOK_SECONDS = 1.0
AGAIN_SECONDS = 5.0  # seconds to wait before adding a robot again after a failure
_CLOCK_SECONDS = 30.0
_PINGS = 5
PING_SECONDS = 5.0
_MAX_PING = 64  # maximum size in bytes of a reply to a ping; a valid reply has 8 bytes
_CALL_SECONDS = 3600.0
# timeout in seconds for a name's holder to reply after another gateway on its machine has claimed the name
CHALLENGE_SECONDS = 2.0
# after removing this many names (about 4 MB), wait this long, then return free memory to the system
TRIM_NAMES, TRIM_SECONDS = 500, 15.0
MAX_ROBOT_NAMES = 2_000  # maximum number of names per robot; all robots share _MAX_IMPORTED
# maximum number of a robot's names to close concurrently: each needs a task and a call to the master
MAX_CONCURRENT_NAMES = 100
MAX_LISTED = 5  # maximum number of robots named in one log line
LINES = 5  # maximum number of log lines of one kind in ten seconds
_WARN_OFFSET = 100_000_000
_MAX_CONCURRENT_ROBOTS = 20  # maximum number of robots to remove concurrently
# maximum number of names to register: the master accepts at most 10,000 per node
_MAX_IMPORTED = 9_000


class ImportedRobot:
    """A robot whose topics and services are registered in the local graph."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.since = time.time()
        self.topics: dict[str, ImportedTopic] = {}
        self.services: dict[str, tuple[ServiceToken, RawService]] = {}
        self.clock: ClockOffset | None = None
        self.measured = 0.0
        self.left = asyncio.Event()


class Importer:
    """Registers the fleet's robots in the local graph.

    Runs on the node's loop, except that messages are handled in other threads.
    """

    def __init__(
        self,
        node: Node,
        network: FleetNetwork,
        definitions: Definitions,
        sender: Sender,
        receiver: Receiver,
        gateway: str,
        own_name: str,
        rules: GatewayRules,
        spawn: Callable[[Coroutine[object, object, None]], object],
        clock: Callable[[], int],
    ) -> None:
        """Create the importer.

        ``gateway`` is the id of this gateway; ``own_name`` is the name of the robot that it exports, or "" if there is none.
        """
        self.robots: dict[str, ImportedRobot] = {}
        self.contents = FleetContents(lambda name: name != own_name and rules.robots(name))
        self._node = node
        self._network = network
        self._shared = Shared(
            node,
            network,
            definitions,
            sender,
            receiver,
            gateway,
            rules,
            spawn,
            clock,
            RateLimitedLogger(_log),
        )
        self._rules = rules
        self._spawn = spawn
        self._clock = clock
        self._reconciling: asyncio.TimerHandle | None = None
        self._not_before = 0.0
        """The earliest time of the next refresh, in seconds of the loop's clock."""
        self._is_reconciling = False
        self._is_full = False
        self._left_out = RateLimitedLogger(_log)
        self._clocks = RateLimitedLogger(_log, LINES)
        self._comings = RateLimitedLogger(_log, LINES)
        self._rivals = RateLimitedLogger(_log, LINES)
        self._waiting: tuple[Refused, ...] = ()
        """The gateways rejected at the last refresh; kept so that each is logged only once."""
        self._removed = 0  # number of names removed since memory was last returned to the system
        self._trimming: asyncio.TimerHandle | None = None
        self._machines: dict[str, str] = {}
        """The machines on which robots were last shown, keyed by robot name."""
        self._challenging: set[str] = set()
        self._is_closed = False
        self._reporter = ErrorReporter(_log, "showing the fleet's robots")
        self._presence = Presence(
            self._answering, lambda: self.contents.gateways, lambda: self._soon(_SETTLE_SECONDS)
        )
        self._watching: list[asyncio.Task[None]] = []
        self._declared: list[Deferred] = []

    @property
    def names(self) -> list[str]:
        """Return the names of the imported robots."""
        return list(self.robots)

    async def start(self) -> None:
        """Start importing robots; continue until :meth:`close`.

        Raise MasterUnreachableError if no master responds, or RpcError if the call fails.
        """
        self._node.parameters.listeners.append(self._parameter_changed)
        await self._node.parameters.add(MACHINES)
        await self._read_machines()
        self._declared = [
            self._network.watch_tokens(f"{ROOT}/{kind}/**", self.changed)
            for kind in ("robot", "topic", "service")
        ]
        self._watching = [
            asyncio.ensure_future(keep_running(watch, self._reporter))
            for watch in (self._watch, self._presence.watch)
        ]

    async def close(self) -> None:
        """Remove all robots. Idempotent."""
        self._is_closed = True
        if self._parameter_changed in self._node.parameters.listeners:
            self._node.parameters.listeners.remove(self._parameter_changed)
        for timer in (self._reconciling, self._trimming):
            if timer:
                timer.cancel()
        watching, self._watching = self._watching, []
        for task in watching:
            task.cancel()
        await asyncio.gather(*watching, return_exceptions=True)
        for declared in self._declared:
            declared.undeclare()
        self._declared = []
        robots, self.robots = self.robots, {}
        await asyncio.gather(*(self._remove(robot) for robot in robots.values()))

    def changed(self, key: str, is_there: bool) -> None:
        refused = self.contents.refused
        changed = self.contents.add(key) if is_there else self.contents.remove(key)
        if self.contents.refused != refused:
            self._left_out.warning("what a gateway announces is not shown: %s", self.contents.refusal)
        if changed:
            self._soon(_SETTLE_SECONDS)
            if not is_there and parse_claim(key):
                self._presence.check_soon()

    def _soon(self, seconds: float) -> None:
        if self._is_closed:
            return
        loop = asyncio.get_running_loop()
        when = max(loop.time() + seconds, self._not_before)
        pending = self._reconciling
        if pending is not None:
            if pending.when() <= when:
                return
            pending.cancel()
        self._reconciling = loop.call_at(when, lambda: self._spawn(self._reconcile()))

    # --- the operator's choices

    def _parameter_changed(self, name: str, _: object) -> None:
        if f"{name}/".startswith(f"{MACHINES}/") or f"{MACHINES}/".startswith(f"{name}/"):
            self._spawn(self._follow_machines())

    async def _follow_machines(self) -> None:
        await self._read_machines()
        self._soon(0.0)

    async def _read_machines(self) -> None:
        self.contents.holders.machines = parse_machines(await self._node.get_param(MACHINES, {}))

    # --- imported robots

    async def _reconcile(self) -> None:
        """Add, update and remove imported robots to match the fleet's contents."""
        if self._is_reconciling:
            self._reconciling = None
            self._soon(_SETTLE_SECONDS)
            return
        self._is_reconciling = True
        self._reconciling = None
        started = time.monotonic()
        try:
            await self._show(self.contents.robots(self._presence.lost))
        finally:
            self._is_reconciling = False
        seconds = time.monotonic() - started
        if seconds > _SETTLE_SECONDS:
            # Pause to let other tasks run while a thousand robots join.
            self._not_before = asyncio.get_running_loop().time() + 2 * seconds
            if self._reconciling is not None:
                self._reconciling.cancel()
                self._reconciling = None
                self._soon(0.0)
        pause = self.contents.holders.pause({refused.claim.name for refused in self.contents.waiting})
        if pause is not None:
            self._soon(max(pause, _SETTLE_SECONDS))

    async def _show(self, robots: dict[str, Robot]) -> None:
        gone, left, joined = [], [], []
        for name, shown in list(self.robots.items()):
            robot = robots.get(name)
            if robot is None or robot.claim != shown.robot.claim:
                gone.append(self.robots.pop(name))
                left.append(name)
        self._report_names(left, "left")
        for first in range(0, len(gone), _MAX_CONCURRENT_ROBOTS):
            # With return_exceptions, one robot's failure does not affect the others.
            for error in await asyncio.gather(
                *map(self._remove, gone[first : first + _MAX_CONCURRENT_ROBOTS]), return_exceptions=True
            ):
                if isinstance(error, Exception):
                    self._reporter.report(error)
        self._trim_soon(sum(len(robot.topics) + len(robot.services) for robot in gone))
        for name, robot in robots.items():
            if name not in self.robots:
                self.robots[name] = ImportedRobot(robot)
                joined.append(name)
                self._report_machine(robot.claim)
        self._report_names(joined, "joined")
        self._report_refused()

        for name, robot in robots.items():
            known = self.robots.get(name)
            if known is None:
                continue  # the robot was closed during the await
            known.robot = robot
            try:
                await self._update(known)
            except Exception as error:  # noqa: BLE001 - one robot's error must not affect the others
                self._reporter.report(error)
                self._soon(AGAIN_SECONDS)

    def _report_names(self, names: list[str], what: str) -> None:
        """Log on one line which robots have joined or left."""
        if len(names) == 1:
            self._comings.info("robot [%s] has %s", names[0], what)
        elif names:
            rest = len(names) - MAX_LISTED
            shown = ", ".join(f"[{name}]" for name in names[:MAX_LISTED])
            more = f" and {rest} more" if rest > 0 else ""
            self._comings.info("%d robots have %s: %s%s", len(names), what, shown, more)

    def _report_machine(self, claim: Claim) -> None:
        """Record the machine that holds a robot's name; log if it was another machine before."""
        before = self._machines.get(claim.name, claim.host)
        if before != claim.host:
            is_chosen = claim.name in self.contents.holders.machines
            self._rivals.warning(
                "robot [%s] is another machine now: %s (gateway %s) in place of %s, %s",
                claim.name,
                claim.host,
                claim.gateway,
                before,
                "as the operator has chosen" if is_chosen else f"which has been gone for {HOLD_SECONDS:g} s",
            )
        if len(self._machines) >= _MAX_IMPORTED:
            self._machines.clear()
        self._machines[claim.name] = claim.host

    def _report_refused(self) -> None:
        """Log, once each, the gateways that are not imported because another gateway holds their name.

        If both run on the same machine, challenge the holder instead.
        """
        known, self._waiting = set(self._waiting), self.contents.waiting
        for refused in self._waiting:
            claim, holder = refused
            if refused in known or holder is None:
                continue
            if claim.host == holder.host:
                self._challenge(refused)
            elif claim.name in self.contents.holders.machines:
                self._rivals.warning(
                    "robot [%s] is shown only from machine %s, which the operator has chosen: machine %s (gateway %s) "
                    "is refused",
                    claim.name,
                    self.contents.holders.machines[claim.name],
                    claim.host,
                    claim.gateway,
                )
            else:
                self._rivals.warning(
                    "two machines call themselves [%s]: %s (gateway %s) came first and is shown, %s (gateway %s) is refused "
                    "until the first has been gone for %g s. To change it: minirospy fleet takeover %s %s",
                    claim.name,
                    holder.host,
                    holder.gateway,
                    claim.host,
                    claim.gateway,
                    HOLD_SECONDS,
                    claim.name,
                    claim.host,
                )

    def _challenge(self, refused: Refused) -> None:
        """Ping the holder of a name: its gateway may have been restarted on the same machine."""
        name = refused.claim.name
        if name not in self._challenging:
            self._challenging.add(name)
            self._spawn(self._ask_holder(refused))

    async def _ask_holder(self, refused: Refused) -> None:
        claim, holder = refused
        assert holder
        try:
            await self._network.query(f"{ROOT}/ping/{holder.gateway}", seconds=CHALLENGE_SECONDS)
        except QueryFailed:
            self.contents.holders.give_up(holder)
            self._soon(0.0)
        else:
            if refused in self.contents.waiting:
                self._rivals.warning(
                    "two gateways of machine %s call themselves [%s]: %s came first and is shown, %s is refused. End one of "
                    "them, or give it another name (--name)",
                    claim.host,
                    claim.name,
                    holder.gateway,
                    claim.gateway,
                )
        finally:
            self._challenging.discard(claim.name)

    async def _update(self, shown: ImportedRobot) -> None:
        robot = shown.robot
        for topic, imported in list(shown.topics.items()):
            token = robot.topics.get(topic)
            if token is None or not imported.update(token):
                await shown.topics.pop(topic).close()
        for service, (known, offered) in list(shown.services.items()):
            if robot.services.get(service) != known:
                del shown.services[service]
                await offered.close()

        for topic, token in robot.topics.items():
            if (
                topic not in shown.topics
                and self._rules.topics(f"/{token.robot}{topic}")
                and self._has_room(shown)
            ):
                imported = shown.topics[topic] = ImportedTopic(self._shared, token, lambda: shown.clock)
                imported.start()
        for service, service_token in robot.services.items():
            name = f"/{robot.claim.name}{service}"
            if service not in shown.services and self._rules.services(name) and self._has_room(shown):
                shown.services[service] = service_token, self._serve(name, service_token, shown.left)

    def _has_room(self, shown: ImportedRobot) -> bool:
        if len(shown.topics) + len(shown.services) >= MAX_ROBOT_NAMES:
            self._left_out.warning(
                "robot [%s] has more than %d topics and services: the others are not shown. Give it --topics or --services",
                shown.robot.claim.name,
                MAX_ROBOT_NAMES,
            )
            return False
        count = sum(len(shown.topics) + len(shown.services) for shown in self.robots.values())
        if count < _MAX_IMPORTED:
            return True
        if not self._is_full:
            self._is_full = True
            _log.error(
                "the fleet has more than %d topics and services: the others are not shown. Give --robots or --topics",
                _MAX_IMPORTED,
            )
        return False

    def _trim_soon(self, removed: int) -> None:
        """Count removed names; after TRIM_NAMES, return free memory to the system a little later, when the links have closed."""
        self._removed += removed
        if self._removed >= TRIM_NAMES and self._trimming is None and not self._is_closed:
            loop = asyncio.get_running_loop()
            self._trimming = loop.call_later(TRIM_SECONDS, self._trim)

    def _trim(self) -> None:
        self._removed, self._trimming = 0, None
        asyncio.get_running_loop().run_in_executor(None, return_free_memory)

    async def _remove(self, shown: ImportedRobot) -> None:
        shown.left.set()
        parts: list[ImportedTopic | RawService] = [
            *shown.topics.values(),
            *(offered for _, offered in shown.services.values()),
        ]
        for first in range(0, len(parts), MAX_CONCURRENT_NAMES):
            await asyncio.gather(*(part.close() for part in parts[first : first + MAX_CONCURRENT_NAMES]))

    def _serve(self, name: str, token: ServiceToken, left: asyncio.Event) -> RawService:
        key = call_key(token.robot, token.gateway, token.service, token.md5sum)

        async def call(request: bytes, _: Header) -> bytes:
            answering = asyncio.ensure_future(self._network.query(key, request, seconds=_CALL_SECONDS))
            leaving = asyncio.ensure_future(left.wait())
            try:
                # Stop waiting as soon as the robot has left: Zenoh itself may take minutes to end the query.
                await asyncio.wait((answering, leaving), return_when=asyncio.FIRST_COMPLETED)
                if not answering.done():
                    raise ServiceException(f"robot [{token.robot}] has left during the call")
                return answering.result()
            except QueryFailed as error:
                raise ServiceException(f"robot [{token.robot}]: {error}") from error
            finally:
                answering.cancel()
                leaving.cancel()

        return RawService(self._node, name, InterfaceType(token.type, token.md5sum), call)

    async def _watch(self) -> None:
        pause = LOOK_SECONDS
        while True:
            await asyncio.sleep(pause)
            started = time.monotonic()
            try:
                self._look(await self._snapshot())
            except (MasterUnreachableError, RpcError) as error:
                _log.debug("the graph cannot be read: %s", error)
            pause = max(LOOK_SECONDS, 20 * (time.monotonic() - started))
            for shown in list(self.robots.values()):
                is_used = any(topic.is_open for topic in shown.topics.values())
                if not shown.measured or (is_used and started - shown.measured > _CLOCK_SECONDS):
                    shown.measured = started
                    self._spawn(self._measure(shown))

    async def _snapshot(self) -> Snapshot | None:
        """Return a snapshot of the local graph, or None if no topic needs it."""
        if any(topic.needs_snapshot for shown in self.robots.values() for topic in shown.topics.values()):
            return await fetch(self._node.call_master)
        return None

    def _look(self, snapshot: Snapshot | None) -> None:
        for shown in list(self.robots.values()):
            for topic in list(shown.topics.values()):
                topic.look(snapshot)

    async def _answering(self) -> list[str] | None:
        """Ping all gateways in the fleet. Return those that respond, or None if the query cannot be sent."""
        start = f"{ROOT}/ping/"
        try:
            answers = await self._network.queries(f"{start}*", seconds=PING_SECONDS, size=_MAX_PING)
        except QueryFailed as error:
            _log.debug("the fleet cannot be queried: %s", error)
            return None
        return [key.removeprefix(start) for key in answers]

    async def _measure(self, shown: ImportedRobot) -> None:
        key = f"{ROOT}/ping/{shown.robot.claim.gateway}"
        pings = []
        try:
            for _ in range(_PINGS):
                sent = self._clock()
                answer = await self._network.query(key, seconds=PING_SECONDS)
                if len(answer) == 8:
                    pings.append(Ping(sent, int.from_bytes(answer, "little", signed=True), self._clock()))
        except QueryFailed as error:
            _log.debug("%s does not answer: %s", shown.robot.claim.name, error)
        if pings:
            self._presence.answered(shown.robot.claim.gateway)
        before, found = shown.clock, offset_of(pings)
        shown.clock = found or before
        if found and abs(found.offset) > _WARN_OFFSET + found.round_trip and before is None:
            self._clocks.warning(
                "the clock of robot [%s] is %.3f s %s this one: times in its messages are its own",
                shown.robot.claim.name,
                abs(found.offset) / 1e9,
                "ahead of" if found.offset > 0 else "behind",
            )
