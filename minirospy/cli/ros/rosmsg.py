"""rosmsg and rossrv: the message and service types that are installed.

Source: http://wiki.ros.org/rosmsg. What is printed is what ROS prints.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from minirospy.cli.command import Parser, refuse_bag
from minirospy.cli.verbs import Family, Verb
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
    _add_type(parser, kind)
    parser.add_argument(
        "-r", "--raw", action="store_true", help="print the definition's own text, with comments"
    )
    parser.add_argument(
        "-b", "--bag", metavar="BAGFILE", help=f"show {kind.word} from .bag file (not yet: bags come later)"
    )
    options = parser.parse_args(argv)
    if options.bag:
        refuse_bag(f"{command} show")
    interfaces = _interfaces(kind)
    for name in _names(parser, options.type):
        for type_ in interfaces.find(name.removesuffix(f".{kind.value}")):
            if "/" not in name:
                print(f"[{type_}]:")
            print(interfaces.text(type_) if options.raw else interfaces.description(type_))


def _list(command: str, kind: Kind, argv: Sequence[str]) -> None:
    Parser(f"{command} list", description=f"List all {kind.word} types.").parse_args(argv)
    print("\n".join(_interfaces(kind).all()))


def _md5(command: str, kind: Kind, argv: Sequence[str]) -> None:
    parser = Parser(f"{command} md5", description=f"Print the md5sum of a {kind.word} type.")
    _add_type(parser, kind)
    options = parser.parse_args(argv)
    interfaces = _interfaces(kind)
    for name in _names(parser, options.type):
        for type_ in interfaces.find(name):
            label = "" if "/" in name else f"[{type_}]: "
            print(label + interfaces.md5sum(type_))


def _package(command: str, kind: Kind, argv: Sequence[str]) -> None:
    parser = Parser(f"{command} package", description=f"List the {kind.word} types of a package.")
    parser.add_argument("package", nargs="?", help="the package's name; without it, read from standard input")
    parser.add_argument("-s", dest="one_line", action="store_true", help="on a single line")
    options = parser.parse_args(argv)
    interfaces = _interfaces(kind)
    for package in _names(parser, options.package):
        print((" " if options.one_line else "\n").join(interfaces.in_package(package)))


def _packages(command: str, kind: Kind, argv: Sequence[str]) -> None:
    parser = Parser(f"{command} packages", description=f"List the packages that define {kind.word} types.")
    parser.add_argument("-s", dest="one_line", action="store_true", help="on a single line")
    options = parser.parse_args(argv)
    print((" " if options.one_line else "\n").join(_interfaces(kind).packages()))


def _add_type(parser: Parser, kind: Kind) -> None:
    parser.add_argument(
        "type",
        nargs="?",
        help=f"pkg/Name, or the Name alone for every {kind.word} type of that name; "
        "without it, read from standard input: rostopic type /t | rosmsg show",
    )


def _names(parser: Parser, name: str | None) -> list[str]:
    """The name that was typed, else those that a pipe brings."""
    if name is not None:
        return [name]
    import sys

    names = [] if sys.stdin.isatty() else sys.stdin.read().split()
    if not names:
        parser.error("a name is missing")
    return names


def _interfaces(kind: Kind) -> Interfaces:
    from minirospy.workspace.packages import Packages

    return Interfaces(Packages(), kind)


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
