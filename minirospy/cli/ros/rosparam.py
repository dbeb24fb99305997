"""rosparam: read and write the parameter server.

Source: http://wiki.ros.org/rosparam. What is printed is what ROS prints.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy.cli.command import Parser
from minirospy.cli.verbs import Family, Verb
from minirospy.errors import NotFoundError, UsageError, ValueTextError
from minirospy.introspect import parameters
from minirospy.introspect.graph import Graph
from minirospy.introspect.values import format_pretty, format_value, parse_value

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status."""
    return _FAMILY.main(argv)


def _set(argv: Sequence[str]) -> None:
    parser = Parser(
        "rosparam set", description="Set a parameter to a YAML value, or to the contents of a file."
    )
    parser.add_argument("parameter", help="the parameter's name")
    parser.add_argument("value", nargs="?", help="YAML: 5, 1.5, true, text, [1, 2], '{x: 1, y: 2}', deg(90)")
    parser.add_argument("-t", "--textfile", metavar="TEXT_FILE", help="set it to the text of a file")
    parser.add_argument("-b", "--binfile", metavar="BINARY_FILE", help="set it to the bytes of a file")
    _add_verbose(parser)
    options = parser.parse_intermixed_args(argv)
    if [options.value, options.textfile, options.binfile].count(None) != 2:
        raise UsageError(
            "please specify a value, or one of -t and -b (`rosparam set -h` shows what there is)"
        )
    if options.textfile is not None:
        value: object = _read(options.textfile)
    elif options.binfile is not None:
        value = _read_bytes(options.binfile)
    else:
        # No text is the empty text to the shell's user; to YAML it would be null.
        value = parse_value(options.value) if options.value else ""
    with Graph.open("rosparam") as graph:
        for name, single in parameters.set_parameter(graph, graph.resolve(options.parameter), value):
            if options.verbose:
                print(f"set parameter [{name}] to [{single}]")


def _get(argv: Sequence[str]) -> None:
    parser = Parser("rosparam get", description="Print the value of a parameter, or of all in a namespace.")
    parser.add_argument("parameter", help="the parameter's name; / for all")
    parser.add_argument("-p", dest="pretty", action="store_true", help="print it for people, not as YAML")
    _add_verbose(parser)
    options = parser.parse_args(argv)
    with Graph.open("rosparam") as graph:
        name = graph.resolve(options.parameter)
        if options.verbose:
            print(f"getting parameter [{name}]")
        value = parameters.get_parameter(graph, name)
        print(format_pretty(value) if options.pretty else format_value(value))


def _load(argv: Sequence[str]) -> None:
    parser = Parser("rosparam load", description="Set parameters from a YAML file.")
    parser.add_argument("file", help="the file; - for standard input")
    parser.add_argument("namespace", nargs="?", default="", help="where they go")
    _add_verbose(parser)
    options = parser.parse_args(argv)
    with Graph.open("rosparam") as graph:
        from_stdin = options.file == "-"
        where = "standard input" if from_stdin else options.file
        if options.verbose:
            print(f"reading parameters from {'stdin' if from_stdin else f'[{options.file}]'}", flush=True)
        text = sys.stdin.read() if from_stdin else _read(options.file)
        files = parameters.parse_parameters(text, where, graph.resolve(options.namespace))
        for file in files:
            if options.verbose and file.own_namespace:
                print(f"reading parameters into namespace [{file.namespace}]")
        for file in files:
            for name, value in parameters.set_parameter(graph, file.namespace, file.values):
                if options.verbose:
                    print(f"{name}={value}")


def _dump(argv: Sequence[str]) -> None:
    parser = Parser("rosparam dump", description="Write parameters to a YAML file, or to standard output.")
    parser.add_argument("file", nargs="?", default="-", help="the file; - for standard output")
    parser.add_argument("namespace", nargs="?", default="", help="only those below this name")
    _add_verbose(parser)
    options = parser.parse_args(argv)
    with Graph.open("rosparam") as graph:
        namespace = graph.resolve(options.namespace)
        values = parameters.get_parameter(graph, namespace)
        if options.file == "-":
            sys.stdout.write(parameters.dump_parameters(values))
            return
        if options.verbose:
            print(f"dumping namespace [{namespace}] to file [{options.file}]")
            print("\n".join(f"{name}={value}" for name, value in parameters.flatten(namespace, values)))
        try:
            with open(options.file, "w", encoding="utf-8") as stream:
                stream.write(parameters.dump_parameters(values))
        except OSError as error:
            raise ValueTextError(options.file, f"cannot be written: {error.strerror}") from error


def _delete(argv: Sequence[str]) -> None:
    parser = Parser("rosparam delete", description="Delete a parameter, or all in a namespace.")
    parser.add_argument("parameter", help="the parameter's name")
    _add_verbose(parser)
    options = parser.parse_args(argv)
    with Graph.open("rosparam") as graph:
        name = graph.resolve(options.parameter)
        parameters.delete_parameter(graph, name)
        if options.verbose:
            print(f"deleted parameter [{name}]")


def _list(argv: Sequence[str]) -> None:
    parser = Parser(
        "rosparam list", description="List the names of the parameters, or of those in a namespace."
    )
    parser.add_argument("namespace", nargs="?", default="/", help="only those below this name")
    options = parser.parse_args(argv)
    with Graph.open("rosparam") as graph:
        print("\n".join(parameters.list_parameters(graph, graph.resolve(options.namespace))))


def _add_verbose(parser: Parser) -> None:
    parser.add_argument("-v", dest="verbose", action="store_true", help="say what is done")


def _read(file: str) -> str:
    return _read_bytes(file).decode("utf-8", "replace").replace("\r\n", "\n")


def _read_bytes(file: str) -> bytes:
    try:
        with open(file, "rb") as stream:
            return stream.read()
    except FileNotFoundError:
        from pathlib import Path

        beside = [str(Path(file).parent / each.name) for each in Path(file).absolute().parent.glob("*")]
        raise NotFoundError("file", file, beside) from None
    except OSError as error:
        raise ValueTextError(file, f"cannot be read: {error.strerror}") from error


_FAMILY = Family(
    "rosparam",
    "rosparam is a command-line tool for getting, setting, and deleting parameters "
    "from the ROS Parameter Server.",
    (
        Verb("set", "set parameter", _set),
        Verb("get", "get parameter", _get),
        Verb("load", "load parameters from file", _load),
        Verb("dump", "dump parameters to file", _dump),
        Verb("delete", "delete parameter", _delete),
        Verb("list", "list parameter names", _list),
    ),
)
