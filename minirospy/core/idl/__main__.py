"""`python -m minirospy.core.idl [SOURCE [TARGET]]`: compile definitions into Python modules.

SOURCE is a folder of packages (default: minirospy's own ``msgs``), TARGET the output folder (default:
minirospy's own overlay).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command
from minirospy.core.idl.load import Catalogue, write_package
from minirospy.core.idl.own_packages import COMPILED_AHEAD, own_definitions

__all__ = ["main"]

_PACKAGE = Path(__file__).parents[2]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return the exit status as defined in minirospy.command.command."""
    return Command("minirospy.core.idl", _parser, _compile).main(argv)


def _parser() -> Parser:
    parser = Parser("python -m minirospy.core.idl", "Compile definitions into Python modules.")
    parser.add_argument(
        "source", nargs="?", type=Path, help="a folder of packages with msg, srv, action folders"
    )
    parser.add_argument("target", nargs="?", type=Path, help="the folder that gets the Python packages")
    return parser


def _compile(source: Path | None, target: Path | None) -> int:
    own = own_definitions()
    catalogue = Catalogue.below(*([source] if source else []), own)
    chosen = Catalogue.below(source or own).packages
    if not chosen:
        raise Misuse(f"no package with a msg, srv or action folder below {source}")
    written = [
        path
        for package in chosen
        for path in write_package(
            catalogue,
            package,
            target or _PACKAGE / "overlay",
            on_demand=source is target is None and package not in COMPILED_AHEAD,
        )
    ]
    print(f"{len(chosen)} packages, {len(written)} files written")
    return 0


if __name__ == "__main__":
    sys.exit(main())
