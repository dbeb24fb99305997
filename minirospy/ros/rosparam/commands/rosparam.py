"""rosparam: read and write the parameter server.

Source: http://wiki.ros.org/rosparam. The output is the same as in ROS.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from minirospy.base.errors import NotFoundError, ValueTextError
from minirospy.command.command import RosText, WordedError
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Family, HelpStatus, Verb
from minirospy.introspect import parameters
from minirospy.introspect.graph import Graph
from minirospy.introspect.values import format_pretty, format_value, parse_value

__all__ = ["FAMILY", "main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return FAMILY.main(argv)


_NO_NAME = "invalid arguments. Please specify a parameter name"


def _set_parser() -> Parser:
    parser = _parser(
        "set",
        "Set a parameter to a YAML value, or to the contents of a file.",
        "[options] parameter value",
        missing=_NO_NAME,
    )

    parser.add_argument("parameter", help="the parameter's name", completer="parameters")
    parser.add_argument(
        "value",
        nargs="?",
        help="YAML: 5, 1.5, true, text, [1, 2], '{x: 1, y: 2}', deg(90)",
        completer="parameter_value",
    )

    parser.add_argument(
        "-t",
        "--textfile",
        metavar="TEXT_FILE",
        help="set parameters to contents of text file",
        completer="files",
    )
    parser.add_argument(
        "-b",
        "--binfile",
        metavar="BINARY_FILE",
        help="set parameters to contents of binary file",
        completer="files",
    )

    _add_verbose(parser)
    return parser


def _set(parameter: str, value: str | None, textfile: str | None, binfile: str | None, verbose: bool) -> None:
    if [value, textfile, binfile].count(None) != 2:
        raise Misuse("please specify a value, or one of -t and -b", _ros_misuse(value, textfile, binfile))

    new: object
    file = textfile if textfile is not None else binfile
    if file is not None and not os.path.exists(file):
        raise Misuse(str(_missing_file(file)), f"file '{file}' does not exist")
    if textfile is not None:
        new = _read(textfile)
    elif binfile is not None:
        new = _read_bytes(binfile)
    else:
        # An omitted value in the shell means an empty string, which YAML would read as null.
        new = parse_value(value) if value else ""

    with Graph.open("rosparam") as graph:
        for name, single in parameters.set_parameter(graph, graph.resolve(parameter), new):
            if verbose:
                print(f"set parameter [{name}] to [{single}]")


def _ros_misuse(value: str | None, textfile: str | None, binfile: str | None) -> str:
    if textfile is not None and binfile is not None:
        return "you may only specify one of --textfile or --binfile"
    return (
        "too many arguments" if value is not None else "invalid arguments. Please specify a parameter value"
    )


def _get_parser() -> Parser:
    parser = _parser(
        "get",
        "Print the value of a parameter, or of all in a namespace.",
        "[options] parameter",
        missing=_NO_NAME,
    )
    parser.add_argument("parameter", help="the parameter's name; / for all", completer="parameters")
    parser.add_argument("-p", dest="pretty", action="store_true", help="pretty print. WARNING: not YAML-safe")
    _add_verbose(parser)
    return parser


def _get(parameter: str, pretty: bool, verbose: bool) -> None:
    with Graph.open("rosparam") as graph:
        name = graph.resolve(parameter)
        if verbose:
            print(f"getting parameter [{name}]")
        value = parameters.get_parameter(graph, name)
        print(format_pretty(value) if pretty else format_value(value))


def _load_parser() -> Parser:
    parser = _parser(
        "load",
        "Set parameters from a YAML file.",
        "[options] file [namespace]",
        missing="invalid arguments. Please specify a file name or - for stdin",
    )
    parser.add_argument("file", help="the file; - for standard input", completer="files")
    _add_namespace(parser, default="", help="where they go")
    _add_verbose(parser)
    return parser


def _load(file: str, namespace: str, verbose: bool) -> None:
    with Graph.open("rosparam") as graph:
        from_stdin = file == "-"
        where = "standard input" if from_stdin else file
        if verbose:
            print(f"reading parameters from {'stdin' if from_stdin else f'[{file}]'}", flush=True)
        text = sys.stdin.read() if from_stdin else _read(file)

        try:
            found = parameters.parse_parameters(text, where, graph.resolve(namespace))
        except parameters.RootValueError as error:
            raise WordedError(error, RosText("ERROR: global / can only be set to a dictionary")) from error
        for each in found:
            if verbose and each.own_namespace:
                print(f"reading parameters into namespace [{each.namespace}]")
        for each in found:
            for name, value in parameters.set_parameter(graph, each.namespace, each.values):
                if verbose:
                    print(f"{name}={value}")


def _dump_parser() -> Parser:
    parser = _parser(
        "dump", "Write parameters to a YAML file, or to standard output.", "[options] file [namespace]"
    )
    parser.add_argument(
        "file", nargs="?", default="-", help="the file; - for standard output", completer="files"
    )
    _add_namespace(parser, default="", help="only those below this name")
    _add_verbose(parser)
    return parser


def _dump(file: str, namespace: str, verbose: bool) -> None:
    with Graph.open("rosparam") as graph:
        resolved = graph.resolve(namespace)
        values = parameters.get_parameter(graph, resolved)

    if file == "-":
        sys.stdout.write(parameters.dump_parameters(values))
        return
    if verbose:
        print(f"dumping namespace [{resolved}] to file [{file}]")
        print("\n".join(f"{name}={value}" for name, value in parameters.flatten(resolved, values)))
    try:
        with open(file, "w", encoding="utf-8") as stream:
            stream.write(parameters.dump_parameters(values))
    except OSError as error:
        raise ValueTextError(file, f"cannot be written: {error.strerror}") from error


def _delete_parser() -> Parser:
    parser = _parser(
        "delete", "Delete a parameter, or all in a namespace.", "[options] parameter", missing=_NO_NAME
    )
    parser.add_argument("parameter", help="the parameter's name", completer="parameters")
    _add_verbose(parser)
    return parser


def _delete(parameter: str, verbose: bool) -> None:
    with Graph.open("rosparam") as graph:
        name = graph.resolve(parameter)
        parameters.delete_parameter(graph, name)
        if verbose:
            print(f"deleted parameter [{name}]")


def _list_parser() -> Parser:
    parser = _parser("list", "List the names of the parameters, or of those in a namespace.", "[namespace]")
    _add_namespace(parser, default="/", help="only those below this name")
    return parser


def _list(namespace: str) -> None:
    with Graph.open("rosparam") as graph:
        print("\n".join(parameters.list_parameters(graph, graph.resolve(namespace))))


def _parser(verb: str, description: str, ros_usage: str, missing: str = "") -> Parser:
    return Parser(
        f"rosparam {verb}",
        description,
        f"rosparam {verb} {ros_usage}",
        missing=missing,
        surplus="too many arguments",
    )


def _add_namespace(parser: Parser, default: str, help: str) -> None:
    parser.add_argument("namespace", nargs="?", default=default, help=help, completer="parameters")


def _add_verbose(parser: Parser) -> None:
    parser.add_argument("-v", dest="verbose", action="store_true", help="turn on verbose output")


def _read(file: str) -> str:
    return _read_bytes(file).decode("utf-8", "replace").replace("\r\n", "\n")


def _read_bytes(file: str) -> bytes:
    try:
        with open(file, "rb") as stream:
            return stream.read()
    except FileNotFoundError:
        raise _missing_file(file) from None
    except OSError as error:
        raise ValueTextError(file, f"cannot be read: {error.strerror}") from error


def _missing_file(file: str) -> NotFoundError:
    from pathlib import Path

    beside = [str(Path(file).parent / each.name) for each in Path(file).absolute().parent.glob("*")]
    return NotFoundError("file", file, beside)


_NOT_SET = RosText("ERROR: Parameter [{name}] is not set")

FAMILY = Family(
    "rosparam",
    "rosparam is a command-line tool for getting, setting, and deleting parameters "
    "from the ROS Parameter Server.",
    (
        Verb("set", "set parameter", _set_parser, _set),
        Verb("get", "get parameter", _get_parser, _get, {"parameter": _NOT_SET}),
        Verb(
            "load",
            "load parameters from file",
            _load_parser,
            _load,
            {"file": RosText("ERROR: file [{name}] does not exist")},
        ),
        Verb("dump", "dump parameters to file", _dump_parser, _dump, {"parameter": _NOT_SET}),
        Verb(
            "delete",
            "delete parameter",
            _delete_parser,
            _delete,
            {"parameter": RosText("ERROR: parameter [{name}] is not set")},
        ),
        Verb("list", "list parameter names", _list_parser, _list),
    ),
    # As in ROS, exit with 0 for an unknown verb, although scripts then miss the error.
    help_status=HelpStatus(none=0, short=0, long=0, unknown=64),
    shows_help_on_error=True,
)
