"""`minirospy fleet`: many robots, each with its own master, in one graph. docs/fleet.md describes how to use it."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING

from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Family, Verb

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.fleet.gateway import Gateway
    from minirospy.fleet.network import NetworkOptions

__all__ = ["FAMILY", "main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return FAMILY.main(argv)


# --- options


def _network_options(parser: Parser, *, listens: bool = True) -> None:
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="where to connect, as tcp/HOST:7447 or HOST (tcp/127.0.0.1:7447); may be repeated",
        completer="nothing",
    )

    if listens:
        parser.add_argument(
            "--listen",
            action="append",
            default=[],
            metavar="ENDPOINT",
            help="let others connect, as tcp/0.0.0.0:7447 (nobody can)",
            completer="nothing",
        )
    parser.add_argument(
        "--config",
        default="",
        metavar="FILE",
        help="configuration of Zenoh (JSON5): TLS, users, access rights",
        completer="files",
    )
    parser.add_argument(
        "--scout",
        action="store_true",
        help="find each other by multicast, in one network; lets others connect",
    )


def _filter_option(parser: Parser, name: str, help: str, completer: str = "nothing") -> None:
    parser.add_argument(name, action="append", default=[], metavar="GLOB", help=help, completer=completer)


def _pass_options(parser: Parser) -> None:
    _network_options(parser)
    _filter_option(parser, "--topics", "topics that are passed (all)", "topics")
    _filter_option(parser, "--services", "services that are passed (all but those of loggers)", "services")
    _filter_option(parser, "--robots", "robots that are shown here (all)")
    parser.add_argument(
        "--rate",
        action="append",
        default=[],
        metavar="GLOB=HZ",
        help="pass at most so many messages a second, as '/camera/*=5'",
        completer="nothing",
    )

    parser.add_argument(
        "--priority",
        action="append",
        default=[],
        metavar="GLOB=PRIORITY",
        help="teleop, data or bulk, as '/arm/*=teleop' (by type)",
        completer="nothing",
    )
    parser.add_argument(
        "--stop-after",
        type=float,
        default=0.5,
        metavar="SECONDS",
        help="publish a zero after velocities from the fleet that stop coming (0.5; 0: never)",
        completer="nothing",
    )
    parser.add_argument(
        "--ros1-keys",
        nargs="?",
        const="*",
        metavar="NAMESPACE",
        help="pass topics and services to and from robots that run zenoh-bridge-ros1, names as they are (namespace *)",
        completer="nothing",
    )


def _gateway_parser() -> Parser:
    parser = Parser(
        "minirospy fleet gateway",
        "Shows this robot's topics and services to the fleet, and passes on those that somebody there uses.",
    )
    parser.add_argument(
        "--name", default="", help="the robot's name; without it this is a control room", completer="nothing"
    )
    parser.add_argument(
        "--import", action="store_true", dest="imports", help="show the other robots here, too"
    )
    _pass_options(parser)
    _filter_option(parser, "--params", "parameters that may be read (all)")
    parser.add_argument(
        "--frames",
        action="store_true",
        help="put the robot's name before frame ids, and pass /tf and /tf_static under their own names",
    )
    return parser


def _control_parser() -> Parser:
    parser = Parser(
        "minirospy fleet control",
        "Shows every robot of the fleet in this graph, its topics and services below its name.",
    )
    _pass_options(parser)
    return parser


def _router_parser() -> Parser:
    parser = Parser(
        "minirospy fleet router",
        "Passes on between gateways that connect to it, as Zenoh's own router `zenohd` does. Needs no master.",
    )
    _network_options(parser)
    return parser


def _status_parser() -> Parser:
    parser = Parser("minirospy fleet status", "Prints the fleet's robots, links, delays and losses.")
    _network_options(parser, listens=False)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--seconds",
        type=float,
        default=3.0,
        help="how long to wait for answers (3)",
        completer="nothing",
    )
    return parser


def _param_parser() -> Parser:
    parser = Parser("minirospy fleet param", "Prints a robot's parameter as YAML; nothing can be set.")
    parser.add_argument("robot", completer="nothing")
    parser.add_argument("parameter", nargs="?", default="/", completer="nothing")
    _network_options(parser, listens=False)
    return parser


def _takeover_parser() -> Parser:
    parser = Parser(
        "minirospy fleet takeover",
        "Chooses which machine's robot the control rooms of this master show if several machines have one name.",
    )
    parser.add_argument("robot", completer="nothing")
    parser.add_argument(
        "machine",
        nargs="?",
        default="",
        help="as the control room names it: 16 hexadecimal digits",
        completer="nothing",
    )
    parser.add_argument(
        "--any", action="store_true", help="take the choice back: the machine that came first"
    )
    return parser


# --- verbs


def _gateway(
    name: str,
    imports: bool,
    connect: Sequence[str],
    listen: Sequence[str],
    config: str,
    scout: bool,
    topics: Sequence[str],
    services: Sequence[str],
    robots: Sequence[str],
    rate: Sequence[str],
    priority: Sequence[str],
    ros1_keys: str | None,
    stop_after: float,
    params: Sequence[str] = (),
    frames: bool = False,
) -> int:
    if not 0.0 <= stop_after <= 60.0:
        raise Misuse(f"--stop-after {stop_after:g} is not between 0 and 60")
    network = _network(connect, listen, config, scout)

    from minirospy.base.name_filter import NameFilter
    from minirospy.fleet.gateway import REGISTRATION_FAULT_LINES, Gateway, GatewayOptions
    from minirospy.fleet.ros1_keys import parse_namespace
    from minirospy.fleet.rules import GatewayRules, parse_priorities, parse_rates
    from minirospy.web.serve import run

    rules = GatewayRules(
        topics=NameFilter.of(topics),
        services=NameFilter.of(services),
        parameters=NameFilter.of(params),
        robots=NameFilter.of(robots),
        rates=parse_rates(rate),
        priorities=parse_priorities(priority),
        has_frames=frames,
        stop_seconds=stop_after,
    )
    namespace = "" if ros1_keys is None else parse_namespace(ros1_keys)
    options = GatewayOptions(name, imports or not name, namespace, network, rules)

    async def start(node: Node) -> Gateway:
        # Route the gateway's log to the node's log.
        logging.getLogger("minirospy.fleet").parent = node.log
        return Gateway(node, options)

    def started(gateway: Gateway) -> None:
        shown = f"robot [{name}] is in the fleet" if name else "the fleet's robots are shown here"
        machine = f", machine {gateway.claim.host}" if name else ""
        gateway.node.log.info("%s (gateway %s%s)", shown, gateway.id, machine)

    return run(
        "fleet_gateway" if name else "fleet_control",
        (),
        start,
        started,
        registration_fault_lines=REGISTRATION_FAULT_LINES,
        connect=Gateway.connect,
    )


def _control(
    connect: Sequence[str],
    listen: Sequence[str],
    config: str,
    scout: bool,
    topics: Sequence[str],
    services: Sequence[str],
    robots: Sequence[str],
    rate: Sequence[str],
    priority: Sequence[str],
    ros1_keys: str | None,
    stop_after: float,
) -> int:
    return _gateway(
        "",
        True,
        connect,
        listen,
        config,
        scout,
        topics,
        services,
        robots,
        rate,
        priority,
        ros1_keys,
        stop_after,
    )


def _router(connect: Sequence[str], listen: Sequence[str], config: str, scout: bool) -> int:
    from minirospy.fleet.network import DEFAULT_ENDPOINT
    from minirospy.fleet.router import run_router

    network = _network(connect, listen or ([] if config else [DEFAULT_ENDPOINT]), config, scout)
    return run_router(network, lambda text: print(text, flush=True))


def _status(connect: Sequence[str], config: str, scout: bool, json: bool, seconds: float) -> int:
    if not 0.1 <= seconds <= 60.0:
        raise Misuse(f"--seconds {seconds:g} is not between 0.1 and 60")
    network = _network(connect, (), config, scout)

    from minirospy.fleet.inquiry import fleet_status, inquire
    from minirospy.fleet.report import as_json, lines

    robots, controls = inquire(network, lambda session: fleet_status(session, seconds))
    if json:
        print(as_json(robots, controls))
        return 0
    for line in lines(robots, controls):
        print(line)
    return 0


def _param(robot: str, parameter: str, connect: Sequence[str], config: str, scout: bool) -> int:
    network = _network(connect, (), config, scout)

    import yaml

    from minirospy.fleet.inquiry import inquire, robot_parameter

    value = inquire(network, lambda session: robot_parameter(session, robot, parameter, 5.0))
    print(yaml.safe_dump(value, allow_unicode=True).removesuffix("...\n"), end="")
    return 0


def _takeover(robot: str, machine: str, any: bool) -> int:
    from minirospy.base.errors import NotFoundError
    from minirospy.fleet.importer import MACHINES
    from minirospy.fleet.keys import is_machine, is_robot_name
    from minirospy.introspect import parameters
    from minirospy.introspect.graph import Graph

    if not is_robot_name(robot):
        raise Misuse(f"[{robot}] cannot be a robot's name")
    if any == bool(machine):
        raise Misuse("give the machine that is to be shown, or --any")
    if machine and not is_machine(machine):
        raise Misuse(
            f"[{machine}] is not a machine: 16 hexadecimal digits, as the control room's warning has them"
        )
    name = f"{MACHINES}/{robot}"
    with Graph.open("fleet") as graph:
        if machine:
            parameters.set_parameter(graph, name, machine)
            print(f"robot [{robot}]: only machine {machine} is shown (parameter {name})")
            return 0
        # Ignore a missing parameter: no machine has been chosen yet.
        with contextlib.suppress(NotFoundError):
            parameters.delete_parameter(graph, name)
    print(f"robot [{robot}]: the machine that came first is shown")
    return 0


def _network(connect: Sequence[str], listen: Sequence[str], config: str, scouts: bool) -> NetworkOptions:
    """Return the network options with the endpoints to connect to and to listen on.

    Raise BridgeError if the library is missing, Misuse if an endpoint is invalid.
    """
    from minirospy.base.environment import Environment
    from minirospy.fleet.network import (
        EndpointError,
        NetworkOptions,
        is_loopback_endpoint,
        require_zenoh,
        to_endpoint,
    )

    require_zenoh(has_many_links=bool(listen or config))
    try:
        options = NetworkOptions(
            tuple(map(to_endpoint, connect)),
            tuple(to_endpoint(each, listens=True) for each in listen),
            config,
            scouts,
        )
    except EndpointError as error:
        raise Misuse(str(error)) from error
    if Environment.read().local:
        beyond = [each for each in (*options.connect, *options.listen) if not is_loopback_endpoint(each)]
        if beyond or scouts or config:
            what = beyond[0] if beyond else "--scout" if scouts else "--config"
            raise Misuse(f"MINIROSPY_LOCAL=1 keeps all on this machine: {what} does not")
    return options


FAMILY = Family(
    "minirospy fleet",
    "minirospy fleet joins robots, each with its own master, into one graph over Zenoh.",
    (
        Verb("gateway", "show this robot to the fleet: gateway --name robot1", _gateway_parser, _gateway),
        Verb("control", "show the fleet's robots in this graph", _control_parser, _control),
        Verb("router", "pass on between gateways that connect to it", _router_parser, _router),
        Verb("status", "print robots, links, delays, losses", _status_parser, _status),
        Verb(
            "takeover",
            "choose the machine that is robot1: takeover robot1 MACHINE",
            _takeover_parser,
            _takeover,
        ),
        Verb("param", "print a robot's parameter: param robot1 /speed", _param_parser, _param),
    ),
    summary="join robots with their own masters over Zenoh",
    wording={},
)
