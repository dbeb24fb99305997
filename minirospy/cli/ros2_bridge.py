"""`minirospy ros2-bridge`: topics, services and actions between ROS 1 and ROS 2 (docs/ros2.md).

The bridge uses an installed ROS 2, or Zenoh if ROS 2 is not installed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.core.idl.load import Catalogue
    from minirospy.ros2.bridge import Ros2Bridge
    from minirospy.ros2.interface import Ros2Side
    from minirospy.ros2.link_table import Pair
    from minirospy.ros2.rules import Rules

__all__ = ["COMMAND", "main"]

_QUIET_LOOKS = 3
_LONELY_LOOKS = 20
_LOOK_SECONDS = 0.5


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser(
        "minirospy ros2-bridge",
        "Passes messages between ROS 1 and ROS 2. It runs next to an installed ROS 2, whose rclpy it imports, or "
        "with --zenoh without one. "
        "A topic is bridged while it has a publisher on one side and a subscriber on the other, a service or "
        "an action while one side offers it.",
    )
    parser.add_argument(
        "--topics",
        action="append",
        default=[],
        metavar="GLOB",
        help="topics that are bridged (all)",
        completer="topics",
    )
    parser.add_argument(
        "--services",
        action="append",
        default=[],
        metavar="GLOB",
        help="services that are bridged (all)",
        completer="services",
    )
    parser.add_argument(
        "--actions",
        action="append",
        default=[],
        metavar="GLOB",
        help="actions that are bridged (all)",
        completer="topics",
    )
    parser.add_argument(
        "--call-timeout",
        type=float,
        default=60.0,
        metavar="SECONDS",
        help="how long a call of a service on the other side may take (60)",
    )
    parser.add_argument(
        "--rules",
        default="",
        metavar="FILE",
        help="which types and fields are which, in the format of ros1_bridge",
        completer="files",
    )
    parser.add_argument(
        "--zenoh",
        action="store_true",
        help="needs no ROS 2 here: passes on to nodes of ROS 2 that run rmw_zenoh, by their router",
    )
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        completer="nothing",
        help="the router of --zenoh, as 192.168.1.5 or tcp/robot.local:7447 (this machine's)",
    )
    parser.add_argument(
        "--list", action="store_true", help="print what would be bridged, and why something is not, and exit"
    )
    return parser


def _ros2_bridge(
    topics: Sequence[str],
    services: Sequence[str],
    actions: Sequence[str],
    call_timeout: float,
    rules: str,
    zenoh: bool,
    connect: Sequence[str],
    list: bool,
) -> int:
    import asyncio
    import os

    from minirospy.base.errors import BridgeError
    from minirospy.base.name_filter import NameFilter
    from minirospy.core.idl.load import Catalogue
    from minirospy.ros2.bridge import Ros2Bridge, Ros2Options
    from minirospy.ros2.links import BRIDGE_PREFIX, parse_domain
    from minirospy.ros2.rules import BUILT_IN, parse_rules
    from minirospy.web.serve import run
    from minirospy.workspace.packages import Packages

    if not call_timeout > 0:
        raise BridgeError(f"--call-timeout {call_timeout:g} is not a number of seconds above 0")
    known = BUILT_IN
    if rules:
        known = known.with_(parse_rules(Path(rules).read_text(encoding="utf-8"), rules))
    if connect and not zenoh:
        raise Misuse("--connect is for --zenoh")
    # Check the domain first: the backends are not opened until a master has been found.
    parse_domain(os.environ.get("ROS_DOMAIN_ID", ""))
    catalogue = Catalogue(Packages().folders())
    open_side = _zenoh(known, catalogue, connect) if zenoh else _rclpy()
    options = Ros2Options(
        NameFilter.of(topics),
        NameFilter.of(services),
        NameFilter.of(actions),
        call_seconds=call_timeout,
        rules=known,
    )

    async def start(node: Node) -> Ros2Bridge | _Listing:
        loop = asyncio.get_running_loop()
        # Open Zenoh in a thread, because that blocks while a router does not respond.
        opened = loop.run_in_executor(None, open_side, BRIDGE_PREFIX) if zenoh else None
        side = await opened if opened else open_side(BRIDGE_PREFIX)
        bridge = Ros2Bridge(node, side, options, catalogue)
        return _Listing(bridge, node) if list else bridge

    name = f"{BRIDGE_PREFIX}_list" if list else BRIDGE_PREFIX
    # Import ROS 1 message classes before ROS 2's packages with the same names.
    return run(name, (), start, lambda _: None, imports_messages=False)


def _rclpy() -> Callable[[str], Ros2Side]:
    from minirospy.ros2.side import RclpySide, require_rclpy

    require_rclpy()
    return RclpySide


def _zenoh(rules: Rules, catalogue: Catalogue, connect: Sequence[str]) -> Callable[[str], Ros2Side]:
    import os

    from minirospy.base.environment import Environment
    from minirospy.ros2.definitions import Definitions
    from minirospy.ros2.zenoh_side import ZenohSide
    from minirospy.zenoh.library import (
        EndpointError,
        NetworkOptions,
        is_loopback_endpoint,
        require_zenoh,
        to_endpoint,
    )

    require_zenoh("ros2-bridge --zenoh", needs_hash=True)
    variable = "ZENOH_SESSION_CONFIG_URI"
    config = os.environ.get(variable, "")
    try:
        options = NetworkOptions(tuple(map(to_endpoint, connect)), config=config, source=variable)
    except EndpointError as error:
        raise Misuse(str(error)) from error
    if Environment.read().local and (config or not all(map(is_loopback_endpoint, options.connect))):
        raise Misuse("MINIROSPY_LOCAL=1 keeps all on this machine: this router may not be on it")
    definitions = Definitions(rules, catalogue)
    return lambda name: ZenohSide(name, options, definitions)


class _Listing:
    """Waits until ROS 2 has discovered its nodes, prints the connections that the bridge would make, and stops the node."""

    def __init__(self, bridge: Ros2Bridge, node: Node) -> None:
        self._bridge = bridge
        self._node = node

    async def start(self) -> None:
        import asyncio

        quiet, before = 0, None
        looks = 0
        while quiet < _QUIET_LOOKS:
            await asyncio.sleep(_LOOK_SECONDS)
            looks += 1
            if looks < _LONELY_LOOKS and not self._bridge.side.nodes():
                # Wait on, because ROS 2 has not discovered the other nodes yet.
                continue
            found = await self._bridge.pairs()
            quiet = quiet + 1 if found == before else 0
            before = found
        for line in _table(before or []):
            print(line)
        self._node.shutdown()

    async def close(self) -> None:
        await self._bridge.close()


def _table(pairs: Sequence[Pair]) -> list[str]:
    from minirospy.ros2.links import Link
    from minirospy.ros2.service_links import ServiceLink

    if not pairs:
        return [
            "no topic has a publisher on one side and a subscriber on the other, and nothing else is offered"
        ]
    lines = []
    for pair in pairs:
        link = pair.link
        match link:
            case Link():
                name = link.topic
            case ServiceLink():
                name = f"{link.service}  service"
            case _:
                name = f"{link.action}  action"
        head = f"{name}  {link.direction.value}  ROS 1 {link.ros1_type}  ROS 2 {link.ros2_type}"
        kept = "  latched" if isinstance(link, Link) and link.is_latched else ""
        lines.append(f"{head}  not bridged: {pair.reason}" if pair.reason else f"{head}{kept}")
    return lines


COMMAND = Command("minirospy ros2-bridge", _parser, _ros2_bridge)
