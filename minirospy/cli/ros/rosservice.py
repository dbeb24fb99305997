"""rosservice: which services there are, of which type; calling them.

Source: http://wiki.ros.org/rosservice. What is printed is what ROS prints.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from minirospy.cli.command import Parser, complain, hint_near, one_argument, warn
from minirospy.cli.verbs import Family, Verb
from minirospy.errors import UsageError
from minirospy.introspect import services
from minirospy.introspect.graph import Graph

if TYPE_CHECKING:
    from minirospy.names import Arguments

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status."""
    return _FAMILY.main(argv)


def _args(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    name = _one_service("args", "Print the names of the fields of a service's request.", argv)
    with Graph.open("rosservice", arguments=arguments) as graph:
        print(" ".join(services.service_arguments(services.service_type(graph, graph.resolve(name)))))


def _info(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    name = _one_service("info", "Print a service's node, URI, type and arguments.", argv)
    with Graph.open("rosservice", arguments=arguments) as graph:
        service = graph.resolve(name)
        offer = services.service_offer(graph, service)
        # What the master knows, before its node is asked, which may have ended.
        print(f"Node: {offer.node}\nURI: {offer.uri}", flush=True)
        type_ = services.service_type(graph, service)
    print(f"Type: {type_}\nArgs: {' '.join(services.service_arguments(type_))}")


def _type(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    name = _one_service("type", "Print a service's type.", argv)
    with Graph.open("rosservice", arguments=arguments) as graph:
        print(services.service_type(graph, graph.resolve(name)))


def _uri(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    name = _one_service("uri", "Print where a service is called.", argv)
    with Graph.open("rosservice", arguments=arguments) as graph:
        print(services.service_uri(graph, graph.resolve(name)))


def _find(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    help_ = "a service type, as std_srvs/SetBool"
    type_ = one_argument("rosservice find", "Print the services of a type.", "type", help_, argv)
    with Graph.open("rosservice", arguments=arguments) as graph:
        print("\n".join(services.find_services_of_type(graph, type_)))


def _list(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    parser = Parser("rosservice list", description="List the services, or those in a namespace.")
    parser.add_argument("namespace", nargs="?", help="only services at or below this name")
    parser.add_argument("-n", "--nodes", action="store_true", help="print the nodes that provide them, too")
    options = parser.parse_args(argv)
    with Graph.open("rosservice", arguments=arguments) as graph:
        for service in services.list_services(
            graph, graph.resolve(options.namespace) if options.namespace else "/"
        ):
            print(f"{service.name} {','.join(service.nodes)}" if options.nodes else service.name)


def _call(argv: Sequence[str], arguments: Arguments | None = None) -> None:
    parser = Parser(
        "rosservice call",
        description="Call a service and print its response.",
        epilog='Arguments are YAML: one dictionary ("data: True"), or a value for each field in order.',
    )
    parser.add_argument("service", help="the service's name")
    parser.add_argument(
        "args", nargs="*", default=[], help="the request's values; a terminal asks for missing ones"
    )
    parser.add_argument("-v", dest="verbose", action="store_true", help="print the request, too")
    parser.add_argument("--wait", action="store_true", help="wait until the service is there")
    options = parser.parse_intermixed_args(argv)
    with Graph.open("rosservice", arguments=arguments) as graph:
        service = graph.resolve(options.service)
        if options.wait:

            def say_so() -> None:
                warn(f"service [{service}] is not there yet", service)
                hint_near(service, graph.state().services)

            services.wait_for_service(graph, service, say_so)
        type_ = services.service_type(graph, service)
        for request in _requests(type_, options.args):
            if options.verbose:
                print(f"{request}\n---", flush=True)
            print(services.call_service(graph, service, type_, request), flush=True)


def _requests(type_: str, texts: Sequence[str]) -> Iterator[Any]:
    """Each request: one of the values typed, or one for each document on standard input.

    In a terminal the fields that have no value yet are asked for.
    """
    from minirospy.introspect.values import message_values, parse_arguments, parse_lines

    names = services.service_arguments(type_)
    values = parse_arguments(texts)
    by_name = len(values) == 1 and isinstance(values[0], dict)
    if sys.stdin.isatty() and len(values) < len(names) and not by_name:
        yield _asked_for(
            services.fill_request(type_, [dict(zip(names, values, strict=False))]), names[: len(values)]
        )
    elif texts or not names:
        yield services.fill_request(type_, values)
    else:
        found = False
        for each in message_values(parse_lines(sys.stdin, "standard input")):
            found = True
            yield services.fill_request(type_, each)
        if not found:
            raise UsageError(f"please specify service arguments: {' '.join(names)}")


def _asked_for(request: Any, known: Sequence[str]) -> Any:
    from minirospy.cli.ros.form import ask_for

    def refuse(error: Exception) -> None:
        complain("rosservice", error)

    try:
        return ask_for(request, input, refuse, known)
    except EOFError:
        raise UsageError("the input ended before all values were given") from None


def _one_service(verb: str, description: str, argv: Sequence[str]) -> str:
    return one_argument(f"rosservice {verb}", description, "service", "the service's name", argv)


_FAMILY = Family(
    "rosservice",
    "",
    (
        Verb("args", "print service arguments", _args),
        Verb("call", "call the service with the provided args", _call),
        Verb("find", "find services by service type", _find),
        Verb("info", "print information about service", _info),
        Verb("list", "list active services", _list),
        Verb("type", "print service type", _type),
        Verb("uri", "print service ROSRPC uri", _uri),
    ),
    "Type rosservice <command> -h for more detailed usage, e.g. 'rosservice call -h'",
    is_node=True,
)
