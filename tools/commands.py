"""`python tools/commands.py`: write the non-Python lists of commands from the registry of commands.

They are the completion words of bash, zsh, fish and PowerShell, and the entry points of the conda recipe. ``--check`` writes
nothing, and exits with 1 if a list is out of date; a test does that, too.
"""

from __future__ import annotations

import argparse
import re
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from minirospy.cli.registry import SHELL_FUNCTIONS, console_scripts  # noqa: E402 - the checkout's

__all__ = ["main", "outdated"]

_WIDTH = 116


def _words() -> list[str]:
    return [*SHELL_FUNCTIONS, *console_scripts()]


def _wrapped(text: str, indent: str, end: str = "") -> str:
    lines = textwrap.wrap(text, _WIDTH - len(indent), break_long_words=False, break_on_hyphens=False)
    return f"{end}\n".join(indent + line for line in lines)


def _posix(indent: str) -> str:
    return _wrapped(" ".join(_words()), indent, " \\").lstrip()


def _powershell() -> str:
    return _wrapped(", ".join(f"'{word}'" for word in _words()), "    ")


def _recipe() -> str:
    return "\n".join(f"    - {name} = {target}" for name, target in console_scripts().items())


LISTS: dict[str, tuple[str, Callable[[], str]]] = {
    "minirospy/workspace/shell/ros.bash": (
        r"(?<=    printf '%s\\n' )roscd.*?(?=\n\})",
        lambda: _posix("        "),
    ),
    "minirospy/workspace/shell/ros.fish": (
        r"(?<=\nfor name in )roscd.*?(?=\n    complete --command \$name --erase)",
        lambda: _posix("        "),
    ),
    "minirospy/workspace/shell/ros.ps1": (r"(?<=\n\$_ros_commands = @\(\n).*?(?=\n\))", _powershell),
    "packaging/conda/meta.yaml": (r"(?<=\n  entry_points:\n).*?(?=\n\nrequirements:)", _recipe),
}
"""For each file, where the list is, and a function that returns the list."""


def outdated(*, write: bool = False) -> list[str]:
    """Return the files whose list differs from the registry; with ``write``, also correct them."""
    found = []
    for name, (place, make) in LISTS.items():
        file = ROOT / name
        old = file.read_text(encoding="utf-8")
        new, count = re.subn(place, lambda _, make=make: make(), old, flags=re.DOTALL)  # type: ignore[misc]
        if count != 1:
            raise ValueError(f"{name} has {count} lists of commands in place of one")
        if new != old:
            found.append(name)
            if write:
                file.write_text(new, encoding="utf-8", newline="\n")
    return found


def main() -> int:
    """Write the lists; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--check", action="store_true", help="write nothing; exit with 1 if a list is out of date"
    )
    options = parser.parse_args()
    found = outdated(write=not options.check)
    for name in found:
        print(f"{name}: {'out of date: run python tools/commands.py' if options.check else 'written'}")
    return 1 if found and options.check else 0


if __name__ == "__main__":
    sys.exit(main())
