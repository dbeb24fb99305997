"""`minirospy bridge`: the graph for browsers, phones and programs without ROS. docs/bridge.md describes how to use it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command, with_options

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.web.bridge import Bridge, BridgeOptions
    from minirospy.web.tokens import Tokens

__all__ = ["COMMAND", "main"]


class BridgeArguments(NamedTuple):
    """The parsed command line of `minirospy bridge`."""

    port: int | None
    rosbridge_port: int | None
    no_rosbridge: bool
    listen: bool
    address: str
    token: str | None
    read_token: str | None
    show_tokens: bool
    new_tokens: bool
    read_only: bool
    origin: Sequence[str]
    host_name: Sequence[str]
    topics: Sequence[str]
    deny_topics: Sequence[str]
    services: Sequence[str]
    deny_services: Sequence[str]
    params: Sequence[str]
    deny_params: Sequence[str]
    publish: Sequence[str]
    cert: str
    key: str
    buffer: int
    connections: int
    name: str
    status: bool
    json: bool


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser(
        "minirospy bridge",
        "Opens the graph to browsers and programs without ROS: by the Foxglove WebSocket protocol (Foxglove, Lichtblick), by "
        "rosbridge (roslib.js, roslibpy), and images over HTTP. "
        "Only programs of this machine may connect, unless --listen is given.",
    )
    parser.add_argument(
        "--port",
        type=int,
        help="port of the Foxglove protocol (8765); 0 takes a free one; with --status: of the bridge (all usual ports)",
    )
    parser.add_argument(
        "--rosbridge-port",
        type=int,
        metavar="PORT",
        completer="nothing",
        help="port of rosbridge (9090; a free one where --port is 0)",
    )
    parser.add_argument("--no-rosbridge", action="store_true", help="do not serve rosbridge, nor rosapi")
    parser.add_argument(
        "--listen",
        action="store_true",
        help="let other machines connect, with a token; prints their links and a QR code",
    )
    parser.add_argument(
        "--address",
        default="",
        help="the address to listen at (127.0.0.1; with --listen 0.0.0.0)",
        completer="nothing",
    )
    parser.add_argument(
        "--token",
        help="the read-write token (default: MINIROSPY_BRIDGE_TOKEN, else one that is kept in ROS_HOME)",
        completer="nothing",
    )
    parser.add_argument(
        "--read-token",
        help="the read-only token (default: MINIROSPY_BRIDGE_READ_TOKEN, else one that is kept in ROS_HOME)",
        completer="nothing",
    )
    parser.add_argument("--show-tokens", action="store_true", help="print the tokens that are kept, and exit")
    parser.add_argument("--new-tokens", action="store_true", help="replace the tokens that are kept")
    parser.add_argument(
        "--read-only", action="store_true", help="let nobody publish, call services or set parameters"
    )
    parser.add_argument(
        "--origin",
        action="append",
        default=[],
        metavar="PATTERN",
        help="pages that may connect, as https://*.example.org",
        completer="nothing",
    )
    parser.add_argument(
        "--host-name",
        action="append",
        default=[],
        metavar="NAME",
        help="a name by which clients reach this machine",
        completer="nothing",
    )

    for kind, completer in (("topics", "topics"), ("services", "services"), ("params", "parameters")):
        parser.add_argument(
            f"--{kind}",
            action="append",
            default=[],
            metavar="GLOB",
            help=f"{kind} that clients may use (all)",
            completer=completer,
        )
        parser.add_argument(
            f"--deny-{kind}",
            action="append",
            default=[],
            metavar="GLOB",
            help=f"{kind} that they may not use",
            completer=completer,
        )
    parser.add_argument(
        "--publish",
        action="append",
        default=[],
        metavar="GLOB",
        help="topics that clients may publish (all)",
        completer="topics",
    )
    parser.add_argument(
        "--cert",
        default="",
        metavar="FILE",
        help="serve wss with this certificate (PEM)",
        completer="files",
    )
    parser.add_argument(
        "--key",
        default="",
        metavar="FILE",
        help="its key (PEM)",
        completer="files",
    )
    parser.add_argument(
        "--buffer",
        type=int,
        default=10_000_000,
        metavar="BYTES",
        help="what may wait for a slow client before old messages are dropped (10000000)",
    )
    parser.add_argument(
        "--connections", type=int, default=256, metavar="COUNT", help="how many may be open (256)"
    )
    parser.add_argument(
        "--name",
        default="minirospy_bridge",
        help="the node's name",
        completer="nothing",
    )
    parser.add_argument(
        "--status", action="store_true", help="print what a running bridge serves, and to whom"
    )
    parser.add_argument("--json", action="store_true", help="with --status: as JSON")
    return parser


def _bridge(given: BridgeArguments) -> int:
    from minirospy.web.serve import require_libraries

    token = _given_token("token", given.token, "MINIROSPY_BRIDGE_TOKEN")
    read_token = _given_token("read-token", given.read_token, "MINIROSPY_BRIDGE_READ_TOKEN")
    if given.status:
        return _show_status(given.port, given.rosbridge_port, token, as_json=given.json)
    port = 8765 if given.port is None else given.port
    _check_range("port", port, 0, 65535)
    rosbridge_port = given.rosbridge_port
    if rosbridge_port is None:
        rosbridge_port = 9090 if port else 0
    _check_range("rosbridge-port", rosbridge_port, 0, 65535)
    if given.show_tokens:
        kept = _tokens("", "", beyond=True, renews=given.new_tokens)
        print(f"read-write: {kept.write}\nread-only: {kept.read}")
        return 0
    if given.json:
        raise Misuse("--json is for --status")
    _check_range("buffer", given.buffer, 1, 1 << 40)
    _check_range("connections", given.connections, 1, 100_000)
    require_libraries()

    from minirospy.base.name_filter import NameFilter
    from minirospy.web.access import Access, is_loopback
    from minirospy.web.addresses import host_names
    from minirospy.web.bridge import Bridge, BridgeOptions
    from minirospy.web.foxglove.endpoint import CAPABILITIES
    from minirospy.web.graph import Filters
    from minirospy.web.serve import run
    from minirospy.web.server.client import Limits

    address = given.address or ("0.0.0.0" if given.listen else "127.0.0.1")
    if not is_loopback(address) and not given.listen:
        raise Misuse(f"--address {address} lets other machines connect: add --listen")
    tokens = _tokens(token, read_token, beyond=given.listen, renews=given.new_tokens)
    options = BridgeOptions(
        address=address,
        foxglove_port=port,
        rosbridge_port=None if given.no_rosbridge else rosbridge_port,
        rosapi=not given.no_rosbridge,
        transforms=not given.no_rosbridge,
        access=Access(
            hosts=(*given.host_name, *host_names()),
            origins=tuple(given.origin),
            read_token=tokens.read,
            write_token="" if given.read_only else tokens.write,
            requires_token=given.listen or bool(token or read_token),
            default_is_read=given.read_only,
        ),
        limits=Limits(queue=given.buffer, connections=given.connections),
        filters=Filters(
            topics=NameFilter.of(given.topics, given.deny_topics),
            publishable=NameFilter.of(given.publish, given.deny_topics),
            services=NameFilter.of(given.services, given.deny_services),
            parameters=NameFilter.of(given.params, given.deny_params),
        ),
        capabilities=CAPABILITIES,
        certificate=given.cert,
        key=given.key,
    )

    async def start(node: Node) -> Bridge:
        return Bridge(node, options)

    return run(given.name, (), start, lambda bridge: _announce(bridge, options, tokens))


def _show_status(port: int | None, rosbridge_port: int | None, token: str, *, as_json: bool) -> int:
    from minirospy.cli.bridge_status import show_status

    ports = [each for each in (port, rosbridge_port) if each is not None]
    for each in ports:
        _check_range("port", each, 1, 65535)
    # Use the default ports of Foxglove, rosbridge and web_video_server.
    return show_status(ports or (8765, 9090, 8080), token, as_json=as_json)


def _check_range(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise Misuse(f"--{name} {value} is not between {low} and {high}")


def _given_token(option: str, given: str | None, variable: str) -> str:
    """Return the token from an option or, if that is not given, an environment variable; return "" if neither is set."""
    if given is None:
        return os.environ.get(variable, "")
    if not given:
        # Reject an empty token: it may come from an unset shell variable, and must not open the bridge to everybody.
        raise Misuse(f"--{option} wants a token of 8 to 200 characters, and got an empty one")
    return given


def _tokens(write: str, read: str, *, beyond: bool, renews: bool) -> Tokens:
    from minirospy.base.environment import Environment
    from minirospy.web.tokens import Tokens, kept_tokens

    if write or read:
        return Tokens(write, read)
    if beyond or renews:
        return kept_tokens(Environment.read().home, renews=renews)
    return Tokens("", "")


def _announce(bridge: Bridge, options: BridgeOptions, tokens: Tokens) -> None:
    from minirospy.web.access import is_loopback
    from minirospy.web.addresses import links, own_addresses, qr_code

    listener = bridge.listeners["foxglove"]
    is_any = options.address in ("0.0.0.0", "::")
    addresses = ["localhost"] if is_any or is_loopback(options.address) else [options.address]
    if options.access.requires_token and not listener.is_encrypted and addresses == ["localhost"]:
        # Print an address instead of localhost, which may resolve to ::1, where another user's server would receive the token.
        # With a certificate, localhost is safe, because the certificate identifies the server.
        addresses = ["::1" if options.address in ("::", "::1") else "127.0.0.1"]
    found = links(addresses, listener.port, encrypted=listener.is_encrypted)
    served = {"Foxglove protocol": listener}
    if rosbridge := bridge.listeners.get("rosbridge"):
        served["rosbridge"] = rosbridge
    own = ""
    if options.access.requires_token:
        own = f"/?token={options.access.write_token or tokens.read}"
    for name, each in served.items():
        [here, *_] = links(addresses, each.port, encrypted=each.is_encrypted).websocket
        print(f"{name} at {here}{own}", flush=True)
    if not options.access.requires_token:
        print(f"open in Foxglove:   {found.foxglove}")
        print(f"open in Lichtblick: {found.lichtblick}", flush=True)
        return

    reached = own_addresses() if is_any else addresses
    remote = links(reached or addresses, listener.port, encrypted=listener.is_encrypted)
    for rights, token in (("read-only", tokens.read), ("read-write", options.access.write_token)):
        for name, each in served.items() if token else ():
            print(f"{rights}, {name}: give the front end this address (it has the token in it)")
            for address in links(reached or addresses, each.port, encrypted=each.is_encrypted).websocket:
                print(f"  {address}/?token={token}")
    shown = tokens.read or options.access.write_token
    if sys.stdout.isatty():
        print(qr_code(f"{remote.websocket[0]}/?token={shown}"), end="")
    sys.stdout.flush()


COMMAND = Command("minirospy bridge", _parser, with_options(BridgeArguments, _bridge))
