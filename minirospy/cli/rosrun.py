"""`rosrun`: run a package's program by its name. Source: http://wiki.ros.org/rosbash#rosrun."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Sequence

from minirospy.cli.command import run
from minirospy.errors import UsageError
from minirospy.workspace.packages import Packages

__all__ = ["main"]

_USAGE = """usage: rosrun [--prefix COMMAND] [--debug] PACKAGE PROGRAM [arguments ...]

Runs PROGRAM of PACKAGE with the arguments. Its exit status is the program's own; 1 where it is not found.
  --prefix COMMAND  put COMMAND in front, as 'gdb --args'
  --debug           print what is run
"""


def main(argv: Sequence[str] | None = None) -> int:
    """The command: the exit status is the program's, or as in minirospy.cli.command where it cannot be run."""
    words = list(sys.argv[1:] if argv is None else argv)
    return run("rosrun", lambda: _rosrun(words))


def _rosrun(words: list[str]) -> int:
    prefix: list[str] = []
    debug = False
    # By hand: what follows PROGRAM is its own, also where it looks like an option of ours.
    while words and words[0].startswith("-"):
        option = words.pop(0)
        if option in ("-h", "--help"):
            print(_USAGE, end="")
            return 0
        if option in ("-d", "--debug"):
            debug = True
        elif option in ("-p", "--prefix") and words:
            prefix = shlex.split(words.pop(0))
        else:
            raise UsageError(
                f"option {option} is unknown, or lacks its value (`rosrun -h` shows what there is)"
            )
    if len(words) < 2:
        raise UsageError("type rosrun PACKAGE PROGRAM (`rosrun -h` shows more)")
    package, program, *arguments = words
    command = [*prefix, *Packages().find_executable(package, program), *arguments]
    if debug:
        print(shlex.join(command), file=sys.stderr, flush=True)
    if sys.platform == "win32":
        # Windows has no exec that keeps the console: wait, and let Ctrl-C be the program's.
        with subprocess.Popen(command) as popen:
            while True:
                try:
                    return popen.wait()
                except KeyboardInterrupt:
                    continue
    sys.stdout.flush()
    try:
        os.execvp(command[0], command)
    except OSError as error:
        raise UsageError(f"cannot run {command[0]}: {error.strerror}") from error


if __name__ == "__main__":
    sys.exit(main())
