"""`minirospy python FILE`: run a program with the Python that has minirospy installed.

This is needed if minirospy has a separate environment (`pipx install minirospy`, `uv tool install minirospy`), because
`python` is then a different Python.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.base.environment import export_local
from minirospy.command.command import run, warn
from minirospy.ros.rosbash.commands.rosrun import become
from minirospy.workspace.hidden_modules import warning_of_hiding_file

__all__ = ["main"]

_HELP = """usage: minirospy python [FILE [ARGS]]

Run a program with the Python that minirospy is installed in, so that it can `import rospy`; without FILE, Python's prompt.
What follows is passed on as it is: options of Python (-m, -c, -i), the file, its arguments.
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return the program's exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    # Do not handle SIGINT here: the program decides which signals it ignores.
    return run("minirospy python", lambda: _python(words), heeds_interrupts=False)


def _python(words: list[str]) -> int:
    if words[:1] in (["-h"], ["--help"]):
        print(_HELP, end="")
        return 0
    program = next((word for word in words if not word.startswith("-")), "")
    if program and (warning := warning_of_hiding_file(Path(program).absolute())):
        warn(warning)
    export_local(os.environ)
    return become([sys.executable, *words])
