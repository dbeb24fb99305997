"""rosservice: lists services, shows their types, and calls them.

Source: http://wiki.ros.org/rosservice. The output is the same as in ROS.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import CallFailed, MessageException, ServiceException, UsageError
from minirospy.base.keyboard import shares_terminal
from minirospy.command.command import NO_MASTER, RosText, WordedError, complain, hint_near, warn
from minirospy.command.parser import Parser
from minirospy.command.verbs import Family, HelpStatus, Verb
from minirospy.introspect import services
from minirospy.introspect.graph import Graph

if TYPE_CHECKING:
    from minirospy.base.names import Arguments
    from minirospy.core.idl.protocols import Message

__all__ = ["FAMILY", "main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return FAMILY.main(argv)


def _service_parser(verb: str, description: str, missing: str = "service must be specified") -> Parser:
    """Return the parser for a verb that takes a service name."""
    parser = Parser(
        f"rosservice {verb}",
        description,
        f"rosservice {verb} /service",
        missing=missing,
        surplus="you may only specify one input service",
    )
    parser.add_argument("service", help="the service's name", completer="services")
    return parser


def _args_parser() -> Parser:
    return _service_parser("args", "Print the names of the fields of a service's request.")


def _args(service: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rosservice", arguments=arguments) as graph:
        print(" ".join(services.service_arguments(services.service_type(graph, graph.resolve(service)))))


def _info_parser() -> Parser:
    return _service_parser(
        "info", "Print a service's node, URI, type and arguments.", "you must specify a service name"
    )


def _info(service: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rosservice", arguments=arguments) as graph:
        name = graph.resolve(service)
        offer = services.service_offer(graph, name)
        # Print the master's information before calling the node, which may be gone.
        print(f"Node: {offer.node}\nURI: {offer.uri}", flush=True)
        type_ = services.service_type(graph, name)
    print(f"Type: {type_}\nArgs: {' '.join(services.service_arguments(type_))}")


def _type_parser() -> Parser:
    return _service_parser("type", "Print the type of a service.")


def _type(service: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rosservice", arguments=arguments) as graph:
        print(services.service_type(graph, graph.resolve(service)))


def _uri_parser() -> Parser:
    return _service_parser("uri", "Print the ROSRPC URI of a service.")


def _uri(service: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rosservice", arguments=arguments) as graph:
        print(services.service_uri(graph, graph.resolve(service)))


def _node_parser() -> Parser:
    return _service_parser("node", "Print the node that provides a service.")


def _node(service: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rosservice", arguments=arguments) as graph:
        print(services.service_offer(graph, graph.resolve(service)).node)


def _find_parser() -> Parser:
    parser = Parser(
        "rosservice find",
        "Print the services of a type.",
        "rosservice find msg-type",
        missing="please specify a message type",
        surplus="you may only specify one message type",
    )
    parser.add_argument("type", help="a service type, as std_srvs/SetBool", completer="service_types")
    return parser


def _find(type: str, arguments: Arguments | None = None) -> None:
    with Graph.open("rosservice", arguments=arguments) as graph:
        print("\n".join(services.find_services_of_type(graph, type)))


def _list_parser() -> Parser:
    parser = Parser(
        "rosservice list",
        "List the services, or those in a namespace.",
        "rosservice list [/namespace]",
        surplus="you may only specify one input namespace",
    )
    parser.add_argument(
        "namespace", nargs="?", help="only services at or below this name", completer="services"
    )
    parser.add_argument("-n", "--nodes", action="store_true", help="print nodes that provide service(s)")
    return parser


def _list(namespace: str | None, nodes: bool, arguments: Arguments | None = None) -> None:
    with Graph.open("rosservice", arguments=arguments) as graph:
        for service in services.list_services(graph, graph.resolve(namespace) if namespace else "/"):
            print(f"{service.name} {','.join(service.nodes)}" if nodes else service.name)


def _call_parser() -> Parser:
    parser = Parser(
        "rosservice call",
        "Call a service and print its response.",
        "rosservice call /service [args...]",
        missing="service must be specified",
        epilog='Arguments are YAML: one dictionary ("data: True"), or a value for each field in order.',
    )
    parser.add_argument("service", help="the service's name", completer="services")
    parser.add_argument(
        "args",
        nargs="*",
        default=[],
        help="the request's values; in a terminal, missing ones are prompted for",
        completer="request_text",
    )
    parser.add_argument("-v", dest="verbose", action="store_true", help="print verbose output")
    parser.add_argument("--wait", action="store_true", help="wait for service to be advertised")
    return parser


def _call(
    service: str, args: Sequence[str], verbose: bool, wait: bool, arguments: Arguments | None = None
) -> None:
    with Graph.open("rosservice", arguments=arguments) as graph:
        name = graph.resolve(service)
        if wait:
            services.wait_for_service(graph, name, lambda: _warn_waiting(graph, name))

        type_ = services.service_type(graph, name)
        for request in _requests(type_, args):
            if verbose:
                print(f"{request}\n---", flush=True)
            try:
                response = services.call_service(graph, name, type_, request)
            except ServiceException as error:
                raise WordedError(error, RosText(f"ERROR: {_as_ros_shows(error, name)}", 2)) from error
            except MessageException as error:
                raise _incorrect_type(type_, error) from error
            print(response, flush=True)


def _as_ros_shows(error: ServiceException, service: str) -> str:
    """Return ROS's message for an error; ROS formats an error from a service handler as bytes."""
    cause = error.__cause__
    if isinstance(cause, CallFailed):
        return f"service [{service}] responded with an error: {cause.text!r}"
    return str(error)


def _incorrect_type(type_: str, error: MessageException) -> WordedError:
    """Return ROS's error message for request values that do not match the type, ending with the type's definition."""
    from minirospy.introspect.interfaces import Interfaces, Kind
    from minirospy.workspace.packages import Packages

    definition = Interfaces(Packages(), Kind.SERVICE).description(type_)
    why = f"  {error.__cause__ or error}\n\nsrv file:\n{definition}"
    text = f"ERROR: Unable to send request. One of the fields has an incorrect type:\n{why}"
    return WordedError(error, RosText(text, 2))


def _warn_waiting(graph: Graph, service: str) -> None:
    warn(f"service [{service}] is not there yet", service)
    hint_near(service, graph.state().services)


def _requests(type_: str, texts: Sequence[str]) -> Iterator[Message]:
    """Yield the requests: one from the command line, or one per document on stdin.

    On a terminal, prompt for fields without a value.
    """
    from minirospy.introspect.values import message_values, parse_arguments, parse_lines

    names = services.service_arguments(type_)
    values = parse_arguments(texts)
    by_name = len(values) == 1 and isinstance(values[0], dict)
    is_terminal = sys.stdin.isatty()
    if is_terminal and len(values) < len(names) and not by_name and not shares_terminal(sys.argv):
        yield _asked_for(
            services.fill_request(type_, [dict(zip(names, values, strict=False))]), names[: len(values)]
        )
    elif texts or not names:
        yield _filled_request(type_, values)
    elif is_terminal:
        raise UsageError(f"please specify service arguments: {' '.join(names)}")
    else:
        found = False
        for each in message_values(parse_lines(sys.stdin, "standard input")):
            found = True
            yield services.fill_request(type_, each)
        if not found:
            raise UsageError(f"please specify service arguments: {' '.join(names)}")


def _filled_request(type_: str, values: Sequence[object]) -> Message:
    try:
        return services.fill_request(type_, values)
    except MessageException as error:
        from minirospy.core.idl.load import service_class
        from minirospy.core.idl.message_text import get_printable_message_args

        expected = get_printable_message_args(service_class(type_)._request_class())
        given = [f" * {value} (type {type(value).__name__})" for value in values]
        lines = [
            f"ERROR: Incompatible arguments to call service:\n{error.__cause__ or error}",
            "Provided arguments are:",
            *given,
            f"\nService arguments are: [{expected}]",
        ]
        raise WordedError(error, RosText("\n".join(lines), 2)) from error


def _asked_for(request: Message, known: Sequence[str]) -> Message:
    from minirospy.command.form import ask_for

    def refuse(error: Exception) -> None:
        complain("rosservice", error)

    try:
        return ask_for(request, input, refuse, known)
    except EOFError:
        raise UsageError("the input ended before all values were given") from None


_NOT_AVAILABLE = RosText("ERROR: Service [{name}] is not available.", 2)

FAMILY = Family(
    "rosservice",
    "",
    (
        Verb("args", "print service arguments", _args_parser, _args, {"service": _NOT_AVAILABLE}),
        Verb(
            "call",
            "call the service with the provided args",
            _call_parser,
            _call,
            {"service": _NOT_AVAILABLE},
        ),
        Verb("find", "find services by service type", _find_parser, _find),
        Verb(
            "info",
            "print information about service",
            _info_parser,
            _info,
            {"service": RosText("ERROR: unknown service")},
        ),
        Verb("list", "list active services", _list_parser, _list),
        # ROS supports this verb but omits it from its help.
        Verb("node", "", _node_parser, _node, {"service": RosText("Unknown service: {name}")}),
        Verb(
            "type",
            "print service type",
            _type_parser,
            _type,
            {"service": RosText("Unknown service [{name}]")},
        ),
        Verb(
            "uri",
            "print service ROSRPC uri",
            _uri_parser,
            _uri,
            {"service": RosText("Unknown service: {name}")},
        ),
    ),
    "Type rosservice <command> -h for more detailed usage, e.g. 'rosservice call -h'",
    is_node=True,
    help_status=HelpStatus(none=64, short=64, long=64, unknown=64),
    shows_help_on_error=True,
    wording={
        "master": NO_MASTER._replace(status=2),
        "no answer from service": RosText(
            "ERROR: Unable to communicate with service [{name}], address [{uri}]", 2
        ),
    },
)
