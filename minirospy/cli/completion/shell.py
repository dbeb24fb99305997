"""`eval "$(minirospy shell)"`: roscd and similar functions, completion and the environment, without a workspace."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.base.errors import UsageError
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command
from minirospy.workspace.build import own_set_up
from minirospy.workspace.setup_files import SHELLS, shell_text

__all__ = ["COMMAND", "main", "shell_name"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return the exit status as minirospy.command.command defines it."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser(
        "minirospy shell",
        'Print what a shell is to evaluate, for example in ~/.bashrc: eval "$(minirospy shell)"',
    )
    parser.add_argument(
        "shell",
        nargs="?",
        help=f"{', '.join(SHELLS)} (default: the one that SHELL names)",
        completer="shells",
    )
    return parser


def shell_name(word: str) -> str:
    """Return the key in ``SHELLS`` for the shell ``word``, or for the one in the variable SHELL if ``word`` is empty.

    Raise UsageError if there is nothing for the shell.
    """
    user_shell = os.environ.get("SHELL", "bat" if sys.platform == "win32" else "bash")
    name = word or Path(user_shell).stem
    # PowerShell's program is named pwsh on Linux and macOS and, since version 6, on Windows, too.
    name = "powershell" if name == "pwsh" else name
    if name in SHELLS:
        return name
    raise UsageError(f"there is nothing for the shell [{name}], only for {', '.join(SHELLS)}")


def _shell(shell: str | None) -> None:
    sys.stdout.write(shell_text(shell_name(shell or ""), own_set_up(Path(), (), ())))


COMMAND = Command("minirospy shell", _parser, _shell)
