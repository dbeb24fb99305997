"""rosmsg and rossrv: show the installed message and service types.

Source: http://wiki.ros.org/rosmsg. The output is the same as in ROS.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from minirospy.base.errors import NotFoundError
from minirospy.command.command import RosText, WordedError
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Family, HelpStatus, Verb
from minirospy.introspect.interfaces import Interfaces, Kind

__all__ = ["ROSMSG", "ROSSRV", "main", "main_srv", "reason_not_shown"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run rosmsg; return its exit status."""
    return ROSMSG.main(argv)


def main_srv(argv: Sequence[str] | None = None) -> int:
    """Run rossrv; return its exit status."""
    return ROSSRV.main(argv)


class _Verbs:
    """The verbs of rosmsg or rossrv."""

    def __init__(self, command: str, kind: Kind) -> None:
        self.command = command
        self.kind = kind

    def show_parser(self, verb: str = "show") -> Parser:
        parser = Parser(
            f"{self.command} {verb}",
            f"Print the definition of a {self.kind.word} type, inner types unfolded.",
            f"{self.command} {verb} [options] <{self.kind.word} type>",
        )
        self._add_type(parser)
        parser.add_argument(
            "-r", "--raw", action="store_true", help="show raw message text, including comments"
        )
        parser.add_argument(
            "-b", "--bag", metavar="BAGFILE", help="show message from .bag file", completer="bag_files"
        )
        return parser

    def show(self, type: str | None, raw: bool, bag: str | None) -> None:
        if bag:
            from minirospy.ros.rosbag.commands.read_from_bag import show_bag

            for name in _names(type):
                show_bag(bag, name, raw=raw)
            return
        interfaces = self._interfaces()
        for name in _names(type):
            try:
                types = interfaces.find(name.removesuffix(f".{self.kind.value}"))
            except NotFoundError as error:
                raise WordedError(
                    error,
                    RosText(
                        reason_not_shown(self.kind, name) if "/" in name else f"Could not find msg '{name}'"
                    ),
                ) from error
            for type_ in types:
                if "/" not in name:
                    print(f"[{type_}]:")
                print(interfaces.text(type_) if raw else interfaces.description(type_))

    def list_parser(self) -> Parser:
        return Parser(f"{self.command} list", f"List all {self.kind.word} types.", f"{self.command} list")

    def list(self) -> None:
        print("\n".join(self._interfaces().all()))

    def md5_parser(self) -> Parser:
        parser = Parser(
            f"{self.command} md5",
            f"Print the md5sum of a {self.kind.word} type.",
            f"{self.command} md5 <{self.kind.word} type>",
        )
        self._add_type(parser)
        return parser

    def md5(self, type: str | None) -> None:
        interfaces = self._interfaces()
        for name in _names(type):
            for type_ in interfaces.find(name):
                label = "" if "/" in name else f"[{type_}]: "
                print(label + interfaces.md5sum(type_))

    def package_parser(self) -> Parser:
        parser = Parser(
            f"{self.command} package",
            f"List the {self.kind.word} types of a package.",
            f"{self.command} package <package>",
        )
        parser.add_argument(
            "package",
            nargs="?",
            help="the package's name; without it, read from standard input",
            completer="package_names",
        )
        parser.add_argument("-s", dest="one_line", action="store_true", help="list all msgs on a single line")
        return parser

    def package(self, package: str | None, one_line: bool) -> None:
        interfaces = self._interfaces()
        for name in _names(package):
            try:
                types = interfaces.in_package(name)
            except NotFoundError as error:
                raise WordedError(error, RosText(_invalid_package(name), 64)) from error
            print((" " if one_line else "\n").join(types))

    def packages_parser(self) -> Parser:
        parser = Parser(
            f"{self.command} packages",
            f"List the packages that define {self.kind.word} types.",
            f"{self.command} packages",
        )
        parser.add_argument(
            "-s", dest="one_line", action="store_true", help="list all packages on a single line"
        )
        return parser

    def packages(self, one_line: bool) -> None:
        print((" " if one_line else "\n").join(self._interfaces().packages()))

    def _add_type(self, parser: Parser) -> None:
        parser.add_argument(
            "type",
            nargs="?",
            help=f"pkg/Name, or the Name alone for every {self.kind.word} type of that name; "
            "without it, read from standard input: rostopic type /t | rosmsg show",
            completer="message_types" if self.kind is Kind.MESSAGE else "service_types",
        )

    def _interfaces(self) -> Interfaces:
        from minirospy.workspace.packages import Packages

        return Interfaces(Packages(), self.kind)


def reason_not_shown(kind: Kind, name: str) -> str:
    """Return ROS's error message for a type that does not exist."""
    from minirospy.workspace.packages import Packages

    package, slash, base = name.partition("/")
    if not slash:
        package, base = "", name
    refused = f"Unable to load msg [{name}]" if kind is Kind.MESSAGE else f"Unknown srv type [{name}]"
    if "/" in base:
        return f"{refused}: invalid name [{name}]"
    packages = Packages()
    try:
        folder = packages.find(package) / kind.value
    except NotFoundError:
        # ROS prints the folders of all packages here, thousands of characters.
        searched = f"{{{len(packages.folders())} packages: rospack list}}"
        return f"{refused}: Cannot locate message [{base}]: unknown package [{package}] on search path [{searched}]"
    return f"{refused}: Cannot locate message [{base}] in package [{package}] with paths [['{folder}']]"


def _names(name: str | None) -> list[str]:
    """Return the name from the command line, or the names from stdin if there is none."""
    if name is not None:
        return [name]
    import sys

    names = [] if sys.stdin.isatty() else sys.stdin.read().split()
    if not names:
        raise Misuse("a name is missing")
    return names


def _invalid_package(name: str) -> str:
    """Return ROS's error message, with the searched folders, for a package that does not exist."""
    from minirospy.workspace.packages import Packages

    roots = (f"\nROS path [{number}]={root}" for number, root in enumerate(Packages().roots))
    return f"Invalid package: {name}{''.join(roots)}"


def _family(command: str, kind: Kind) -> Family:
    verbs = _Verbs(command, kind)
    word = kind.word
    unknown_type = {f"{word} type": RosText("Cannot locate [{name}]")}

    return Family(
        command,
        f"{command} is a command-line tool for displaying information about ROS {word.capitalize()} types.",
        (
            Verb("show", f"Show {word} description", verbs.show_parser, verbs.show),
            Verb("info", f"Alias for {command} show", partial(verbs.show_parser, "info"), verbs.show),
            Verb("list", f"List all {word}s", verbs.list_parser, verbs.list),
            Verb(
                "md5",
                f"Display {word} md5sum",
                verbs.md5_parser,
                verbs.md5,
                unknown_type,
            ),
            Verb(
                "package",
                f"List {word}s in a package",
                verbs.package_parser,
                verbs.package,
            ),
            Verb("packages", f"List packages that contain {word}s", verbs.packages_parser, verbs.packages),
        ),
        f"Type {command} <command> -h for more detailed usage",
        help_status=HelpStatus(none=0, short=64, long=0, unknown=64),
        shows_help_on_error=True,
    )


ROSMSG = _family("rosmsg", Kind.MESSAGE)
ROSSRV = _family("rossrv", Kind.SERVICE)
