"""`rosrun`: run a program from a package. Source: http://wiki.ros.org/rosbash#rosrun."""

from __future__ import annotations

import errno
import os
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.base.child_lifetime import guard_children
from minirospy.base.environment import export_local
from minirospy.base.errors import NotFoundError, UsageError
from minirospy.command.command import RosText, WordedError, run, warn
from minirospy.workspace.hidden_modules import warning_of_hiding_file
from minirospy.workspace.packages import NotExecutableError, Packages, why_ros_refuses, with_prefix
from minirospy.workspace.stale import warning_of_stale_definitions

__all__ = ["become", "main"]

_ROS_USAGE = """Usage: rosrun [--prefix cmd] [--debug] PACKAGE EXECUTABLE [ARGS]
  rosrun will locate PACKAGE and try to find
  an executable named EXECUTABLE in the PACKAGE tree.
  If it finds it, it will run it with ARGS.
"""

_HELP = f"""{_ROS_USAGE}
EXECUTABLE is a file's name anywhere below PACKAGE, or its path from there.
  -p, --prefix cmd  put cmd in front, as 'gdb --args'
  -d, --debug       print what is run
Exit status: the program's; 2 where PACKAGE, 3 where EXECUTABLE is not found.
"""

_NO_PACKAGE = 2
_NO_EXECUTABLE = 3


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return the program's exit status, or one from minirospy.command.command if it cannot start."""
    words = list(sys.argv[1:] if argv is None else argv)
    # Do not handle interrupts: the program decides how to handle signals.
    return run("rosrun", lambda: _rosrun(words), heeds_interrupts=False)


def _rosrun(words: list[str]) -> int:
    prefix: list[str] = []
    debug = False
    # Parse by hand: words after EXECUTABLE belong to the program, even if they look like rosrun options.
    while words and words[0].startswith("-"):
        option, equals, value = words.pop(0).partition("=")
        if option in ("-h", "--help"):
            print(_HELP, end="")
            return 0
        if option in ("-d", "--debug") and not equals:
            debug = True
        elif option in ("-p", "--prefix") and (equals or words):
            prefix = _split(value if equals else words.pop(0))
        else:
            raise UsageError(
                f"option {option} is unknown, or lacks its value (`rosrun -h` shows what there is)"
            )

    packages = Packages()
    if len(words) < 2:
        print(_ROS_USAGE, end="", flush=True)
        raise UsageError(f"type rosrun PACKAGE EXECUTABLE{_what_there_is(words, packages)}")

    package, program, *arguments = words
    commands = _find(packages, package, program)
    chosen = commands[0] if len(commands) == 1 else _choose(package, commands, packages)
    command = [*with_prefix(prefix, chosen), *arguments]
    if why := why_ros_refuses(Path(chosen[-1])):
        warn(why)
    if hiding := warning_of_hiding_file(Path(chosen[-1])):
        warn(hiding)
    if stale := warning_of_stale_definitions(packages.find(package)):
        warn(stale)
    if debug:
        print(f"[rosrun] Looking in rospack dir: {packages.find(package)}", file=sys.stderr)
        print(f"[rosrun] Running {shlex.join(command)}", file=sys.stderr, flush=True)
    sys.stdout.flush()
    export_local(os.environ)
    return become(command)


def _what_there_is(words: list[str], packages: Packages) -> str:
    """Return a hint about a missing program or package. Raise NotFoundError if no similar name exists."""
    if not words:
        return " (`rosrun -h` shows more)"
    try:
        programs = packages.executables(words[0])
    except NotFoundError:
        program = words[0].rpartition("/")[2]
        owner = next((name for name in packages.names() if program in packages.executables(name)), None)
        if owner is None:
            raise
        return f", as `rosrun {owner} {program}`"
    return f": [{words[0]}] has {', '.join(programs) or 'no programs'}"


def _has(packages: Packages, package: str, program: str) -> bool:
    try:
        return program in packages.executables(package)
    except NotFoundError:
        return False


def _find(packages: Packages, package: str, program: str) -> list[list[str]]:
    """Return the possible commands for running a program.

    Raise WordedError, with the exit status of ROS's rosrun, if the program does not exist.
    """
    try:
        folder = packages.find(package)
    except NotFoundError as error:
        ros = RosText(f"[rospack] Error: package '{package}' not found", _NO_PACKAGE)
        if _has(packages, program, package):
            error.hint = f"the package comes first: `rosrun {program} {package}`"
        raise WordedError(error, ros) from error
    try:
        return packages.find_executables(package, program)
    except (NotFoundError, NotExecutableError) as error:
        is_path = "/" in program
        where = f"{folder}/{program}" if is_path else f"{program} below {folder}"
        print(f"[rosrun] Couldn't find executable named {where}")
        if isinstance(error, NotExecutableError) and not is_path:
            print("[rosrun] Found the following, but they're either not files,\n[rosrun] or not executable:")
            print(f"[rosrun]   {error.path}")
        raise WordedError(error, RosText("", _NO_EXECUTABLE)) from error


def _split(prefix: str) -> list[str]:
    try:
        return shlex.split(prefix)
    except ValueError as error:
        raise UsageError(f"--prefix [{prefix}]: {error}") from error


def _choose(package: str, commands: Sequence[list[str]], packages: Packages) -> list[str]:
    """Prompt the user to choose between programs with the same name; return the command for the chosen one.

    Raise UsageError at end of input.
    """
    paths = [command[-1] for command in commands]
    print("[rosrun] You have chosen a non-unique executable, please pick one of the following:", flush=True)
    for number, path in enumerate(paths, 1):
        print(f"{number}) {path}", file=sys.stderr)
    while True:
        print("#? ", end="", file=sys.stderr, flush=True)
        answer = sys.stdin.readline()
        if not answer:
            near = os.path.relpath(paths[0], packages.find(package)).replace(os.sep, "/")
            raise UsageError(f"nobody chose: name the path, as `rosrun {package} {near}`")
        if answer.strip().isdecimal() and 1 <= int(answer) <= len(commands):
            return commands[int(answer) - 1]


def become(command: list[str]) -> int:
    """Replace this process with the program, which then receives all signals and sets the exit status."""
    if sys.platform == "win32":
        # On Windows, exec detaches the program from the console: wait for it instead, and let it handle Ctrl-C.
        try:
            with guard_children(), subprocess.Popen(command) as popen:
                while True:
                    try:
                        return popen.wait()
                    except KeyboardInterrupt:
                        continue
        except OSError as error:
            raise UsageError(f"cannot run {command[0]}: {error.strerror}") from error

    try:
        os.execvp(command[0], command)
    except OSError as error:
        if error.errno == errno.ENOEXEC:
            # Like a shell, run a script without a `#!` line with sh.
            os.execv("/bin/sh", ["/bin/sh", *command])

        why = error.strerror or str(error)
        if error.errno == errno.ENOENT and os.path.isfile(command[0]):
            with open(command[0], "rb") as file:
                line = file.readline(200).decode("utf-8", "replace").rstrip("\n")
            why = f"its first line names [{line.removeprefix('#!').strip()}], which does not exist"
            if line.endswith("\r"):
                why = "its lines end as those of Windows: save it with Unix line ends (`sed -i 's/\\r$//' FILE`)"
        raise UsageError(f"cannot run {command[0]}: {why}") from error


if __name__ == "__main__":
    sys.exit(main())
