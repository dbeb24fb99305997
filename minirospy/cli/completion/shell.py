"""`eval "$(minirospy shell)"`: roscd and the like, completion and the environment, without a workspace."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.cli.command import Parser, run
from minirospy.errors import UsageError
from minirospy.workspace.build import own_set_up
from minirospy.workspace.setup_files import SHELLS, shell_text

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """The command; exit status as in minirospy.cli.command."""

    def body() -> None:
        parser = Parser(
            "minirospy shell",
            description='Print what a shell is to evaluate, for example in ~/.bashrc: eval "$(minirospy shell)"',
        )
        parser.add_argument(
            "shell", nargs="?", help=f"{', '.join(SHELLS)} (default: the one that SHELL names)"
        )
        options = parser.parse_args(argv)
        shell = (
            options.shell or Path(os.environ.get("SHELL", "bat" if sys.platform == "win32" else "bash")).stem
        )
        if shell not in SHELLS:
            raise UsageError(f"there is nothing for the shell [{shell}], only for {', '.join(SHELLS)}")
        sys.stdout.write(shell_text(shell, own_set_up(Path(), (), ())))

    return run("minirospy shell", body)
