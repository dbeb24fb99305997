"""rosmsg and rossrv: the message and service types that are installed.

Source: http://wiki.ros.org/rosmsg. What is printed is what ROS prints.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from minirospy.cli.command import Parser
from minirospy.cli.verbs import Family, Verb
from minirospy.errors import UsageError
from minirospy.introspect.interfaces import Interfaces, Kind

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["main", "main_srv"]


def main(argv: Sequence[str] | None = None) -> int:
    """rosmsg; its exit status."""
    return _family("rosmsg", Kind.MESSAGE).main(argv)


def main_srv(argv: Sequence[str] | None = None) -> int:
    """rossrv; its exit status."""
    return _family("rossrv", Kind.SERVICE).main(argv)


def _show(command: str, kind: Kind, argv: Sequence[str]) -> None:
    parser = Parser(
        f"{command} show", description=f"Print the definition of a {kind.word} type, inner types unfolded."
    )
    parser.add_argument("type", help=f"pkg/Name, or the Name alone for every {kind.word} type of that name")
    parser.add_argument(
        "-r", "--raw", action="store_true", help="print the definition's own text, with comments"
    )
    if kind is Kind.MESSAGE:
        parser.add_argument(
            "-b", "--bag", metavar="BAGFILE", help="not here: types are read from packages alone"
        )
    options = parser.parse_args(argv)
    if getattr(options, "bag", None):
        raise UsageError("-b: types are read from packages alone, bags are not")
    interfaces = _interfaces(kind)
    for type_ in interfaces.find(options.type):
        if "/" not in options.type:
            print(f"[{type_}]:")
        print(interfaces.text(type_) if options.raw else interfaces.description(type_))


def _list(command: str, kind: Kind, argv: Sequence[str]) -> None:
    Parser(f"{command} list", description=f"List all {kind.word} types.").parse_args(argv)
    print("\n".join(_interfaces(kind).all()))


def _md5(command: str, kind: Kind, argv: Sequence[str]) -> None:
    parser = Parser(f"{command} md5", description=f"Print the md5sum of a {kind.word} type.")
    parser.add_argument("type", help=f"pkg/Name, or the Name alone for every {kind.word} type of that name")
    options = parser.parse_args(argv)
    interfaces = _interfaces(kind)
    for type_ in interfaces.find(options.type):
        label = "" if "/" in options.type else f"[{type_}]: "
        print(label + interfaces.md5sum(type_))


def _package(command: str, kind: Kind, argv: Sequence[str]) -> None:
    parser = Parser(f"{command} package", description=f"List the {kind.word} types of a package.")
    parser.add_argument("package", help="the package's name")
    parser.add_argument("-s", dest="one_line", action="store_true", help="on a single line")
    options = parser.parse_args(argv)
    print((" " if options.one_line else "\n").join(_interfaces(kind).in_package(options.package)))


def _packages(command: str, kind: Kind, argv: Sequence[str]) -> None:
    parser = Parser(f"{command} packages", description=f"List the packages that define {kind.word} types.")
    parser.add_argument("-s", dest="one_line", action="store_true", help="on a single line")
    options = parser.parse_args(argv)
    print((" " if options.one_line else "\n").join(_interfaces(kind).packages()))


def _interfaces(kind: Kind) -> Interfaces:
    from minirospy.environment import Environment
    from minirospy.workspace.packages import Packages

    return Interfaces(Packages(Environment.read(host="localhost")), kind)


def _family(command: str, kind: Kind) -> Family:
    def verb(name: str, summary: str, body: Callable[[str, Kind, Sequence[str]], None]) -> Verb:
        return Verb(name, summary, lambda argv: body(command, kind, argv))

    word = kind.word
    return Family(
        command,
        f"{command} is a command-line tool for displaying information about ROS {word.capitalize()} types.",
        (
            verb("show", f"Show {word} description", _show),
            verb("info", f"Alias for {command} show", _show),
            verb("list", f"List all {word}s", _list),
            verb("md5", f"Display {word} md5sum", _md5),
            verb("package", f"List {word}s in a package", _package),
            verb("packages", f"List packages that contain {word}s", _packages),
        ),
        f"Type {command} <command> -h for more detailed usage",
    )
