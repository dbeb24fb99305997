"""rosmsg-proto: print a message or request with default values as YAML, for completion in shells and editors.

Source: the output of `rosmsg-proto -h` in ROS 1. Output and exit statuses are the same as in ROS.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from minirospy.base.errors import DefinitionError, NotFoundError
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command

__all__ = ["COMMAND", "main"]

_INSUFFICIENT = 64


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser("rosmsg-proto", "Print a message or request of default values as YAML.", intermixed=True)
    parser.add_argument("mode", nargs="?", help="msg or srv", completer="kinds")
    parser.add_argument("type", nargs="?", help="pkg/Name, or the Name alone", completer="prototype_types")

    parser.add_argument("-f", "--flow_style", choices=("0", "1"), help="1: brackets everywhere; 0: nowhere")
    parser.add_argument("-s", "--silent", action="store_true", help="print no errors")
    parser.add_argument(
        "-p", "--prefix", default="", help="what to print before each line", completer="nothing"
    )
    parser.add_argument("-H", "--no-hyphens", action="store_true", help="no quotation marks around it all")
    parser.add_argument(
        "-e", "--empty-arrays", action="store_true", help="arrays of no fixed length are empty"
    )

    parser.add_argument(
        "-x",
        "--exclude-slots",
        default="",
        metavar="FIELDS",
        help="fields to leave out, with commas between",
        completer="nothing",
    )
    return parser


def _rosmsg_proto(
    mode: str | None,
    type: str | None,
    flow_style: str | None,
    silent: bool,
    prefix: str,
    no_hyphens: bool,
    empty_arrays: bool,
    exclude_slots: str,
) -> int:
    def fail(status: int, text: str) -> int:
        if silent:
            return 0
        print(text, file=sys.stderr)
        return status

    if type is None:
        return fail(_INSUFFICIENT, "Insufficient arguments")
    if mode not in ("msg", "srv"):
        return fail(1, f"Invalid mode: .{mode}")
    try:
        text = _prototype(mode, type, exclude_slots.split(","), empty_arrays)
    except (NotFoundError, DefinitionError) as error:
        kind = "class:" if "/" in type else "name"
        return fail(1, f"Unknown message {kind} {type}\nrosmsg-proto: ERROR: {error}")
    if flow_style:
        text = _restyled(text, flow=flow_style == "1")
    if prefix:
        text = "\n".join(prefix + line for line in text.split("\n"))
    print(text if no_hyphens else f'"{text}"')
    return 0


def _prototype(mode: str, name: str, without: Sequence[str], empty_arrays: bool) -> str:
    from minirospy.core.idl.load import Catalogue
    from minirospy.introspect.interfaces import Interfaces, Kind
    from minirospy.introspect.prototype import prototype
    from minirospy.workspace.packages import Packages

    packages = Packages()
    (type_, *_) = Interfaces(packages, Kind(mode)).find(name)
    catalogue = Catalogue(packages.folders())
    if mode == "msg":
        spec = catalogue.message(type_)
    else:
        services = catalogue.services(type_.partition("/")[0])
        spec = next(each.request for each in services if each.full_name == type_)
    return prototype(spec, catalogue, without=without, empty_arrays=empty_arrays)


def _restyled(text: str, *, flow: bool) -> str:
    import yaml

    return str(yaml.safe_dump(yaml.safe_load(text), default_flow_style=flow, sort_keys=False)).removesuffix(
        "\n"
    )


COMMAND = Command("rosmsg-proto", _parser, _rosmsg_proto)
