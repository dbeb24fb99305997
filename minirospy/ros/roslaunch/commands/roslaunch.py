"""`roslaunch`: run launch files. Source: http://wiki.ros.org/roslaunch/Commandline%20Tools."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base import private_files
from minirospy.base.environment import Environment
from minirospy.base.errors import LaunchError, MinirospyError, NotFoundError, UsageError
from minirospy.command.command import RosText, WordedError, warn
from minirospy.command.parser import AssignmentParser, Misuse, Parser
from minirospy.command.verbs import Command, with_options
from minirospy.ros.roslaunch.launcher.arg_docs import resolved_arg_docs
from minirospy.ros.roslaunch.launcher.command import shell_line
from minirospy.ros.roslaunch.launcher.files import LaunchFileNotFoundError, find_files
from minirospy.ros.roslaunch.launcher.load import STDIN, LaunchSource, load_sources
from minirospy.ros.roslaunch.launcher.spec import ArgDoc, LaunchSpec, NodeSpec
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.ros.roslaunch.launcher.runner import RunOptions

__all__ = ["COMMAND", "LaunchOptions", "main"]

_USAGE = """roslaunch [options] [package] <filename> [arg_name:=value...]
       roslaunch [options] <filename> [<filename>...] [arg_name:=value...]

If <filename> is a single dash ('-'), launch XML is read from standard input."""


class LaunchOptions(NamedTuple):
    """The command-line options of roslaunch."""

    what: list[str]
    args: dict[str, str]
    """The command line's ``name:=value`` arguments, keyed by name."""
    nodes: bool
    files: bool
    find_node: str | None
    node_args: str | None
    ros_args: bool
    dump_params: bool
    check: bool
    port: int | None
    wait: bool
    local: bool
    screen: bool
    log: bool
    required: bool
    core: bool
    watch: bool
    ui: bool
    verbose: bool
    no_summary: bool
    pid: str | None
    disable_title: bool
    skip_log_check: bool
    timeout: float | None
    master_logger_level: str | None
    sigint_timeout: float
    sigterm_timeout: float
    child: str | None
    server_uri: str | None
    run_id: str | None


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 1 if a required node failed, else an exit status as in minirospy.command.command."""
    return COMMAND.main(argv)


def _roslaunch(options: LaunchOptions) -> int:
    try:
        return _launch(options)
    except LaunchFileNotFoundError as error:
        raise WordedError(error, RosText(f"RLException: {error.ros_text}")) from error
    except LaunchError as error:
        raise WordedError(error, RosText(f"RLException: {error.text}")) from error


def _launch(options: LaunchOptions) -> int:
    environment = Environment.read()
    if options.port is not None:
        if not 0 < options.port < 65536:
            raise Misuse(f"port {options.port} is not between 1 and 65535")
        environment = environment._replace(master_uri=f"http://{environment.uri_host}:{options.port}")

    packages = Packages(environment)
    if options.child or options.server_uri or options.run_id:
        return _child(options, environment, packages)
    if not options.what and not options.core:
        raise Misuse(
            "specify what to launch: PACKAGE FILE, or one or more launch files",
            "you must specify at least one input file",
        )

    files = [STDIN] if options.what == ["-"] else find_files(options.what, packages)
    text = sys.stdin.read() if files == [STDIN] else None
    if options.ros_args:
        if text is not None:
            raise Misuse("--ros-args takes a file")
        _print_args(resolved_arg_docs(files[-1], options.args, packages))
        return 0

    sources = [LaunchSource(file, None if text is None else text.encode(), options.args) for file in files]
    if options.check:
        return _check(sources, packages)
    spec = load_sources(sources, packages)
    _warn_of_unknown(options.args, spec)
    for name, show in _SHOWS.items():
        if (asked := getattr(options, name)) not in (None, False):
            show(spec, asked, packages)
            return 0
    return _run(options, spec, environment, packages, " ".join(Path(file).name for file in files))


def _run(
    options: LaunchOptions, spec: LaunchSpec, environment: Environment, packages: Packages, name: str
) -> int:
    from minirospy.ros.roslaunch.launcher.output import Output
    from minirospy.ros.roslaunch.launcher.runner import Launcher

    if options.pid:
        try:
            with private_files.open_text(Path(options.pid), "w") as pid_file:
                pid_file.write(f"{os.getpid()}\n")
        except OSError as error:
            raise MinirospyError(f"cannot write [{options.pid}]: {error.strerror}") from error
    output = Output(title=not options.disable_title)
    if options.ui and not sys.stdout.isatty():
        raise UsageError("--ui draws on a terminal, and the output is none")
    launcher = Launcher(spec, environment, packages, _run_options(options, name), output)
    if options.verbose:
        for file in spec.files:
            output.print(f"... loading XML file [{file}]")
    if not options.skip_log_check:
        from minirospy.ros.roslaunch.launcher.output import warn_of_large_logs

        warn_of_large_logs(environment.log_dir, output)
    if not options.ui:
        return launcher.run(wait=options.wait)
    from minirospy.ros.roslaunch.launcher.live import LiveTable

    with LiveTable(launcher):
        return launcher.run(wait=options.wait)


def _run_options(options: LaunchOptions, name: str) -> RunOptions:
    from minirospy.ros.roslaunch.launcher.process import Timeouts
    from minirospy.ros.roslaunch.launcher.runner import RunOptions

    master: list[str] = []
    for option, value in (
        ("--master-logger-level", options.master_logger_level),
        ("--timeout", options.timeout),
    ):
        if value is not None:
            master += [option, str(value)]
    return RunOptions(
        screen=options.screen,
        log=options.log or options.ui,
        log_errors=options.ui,
        required=options.required,
        local=options.local,
        watch=options.watch,
        summary=not options.no_summary,
        name=name,
        inherit_stdin=not options.ui,
        timeouts=Timeouts(options.sigint_timeout, options.sigterm_timeout),
        master_arguments=tuple(master),
    )


def _child(options: LaunchOptions, environment: Environment, packages: Packages) -> int:
    if not (options.child and options.server_uri and options.run_id):
        raise Misuse("--child, --server_uri and --run_id go together")

    from minirospy.ros.roslaunch.launcher.child import run_child

    return run_child(
        options.child, options.server_uri, options.run_id, environment, packages, _run_options(options, "")
    )


def _parser() -> Parser:
    parser = AssignmentParser(
        "roslaunch",
        "Runs the nodes of launch files, and a master where there is none. Ctrl-C stops them all.",
        _USAGE,
    )

    add = parser.add_argument
    add("what", nargs="*", help=argparse.SUPPRESS, completer="launch_words")
    add(
        "--files",
        action="store_true",
        help="Print list files loaded by launch file, including launch file itself",
    )
    add(
        "--args",
        dest="node_args",
        metavar="NODE_NAME",
        help="Print command-line arguments for node",
        completer="launch_nodes",
    )

    add("--nodes", action="store_true", help="Print list of node names in launch file")
    add(
        "--find-node",
        metavar="NODE_NAME",
        help="Find launch file that node is defined in",
        completer="launch_nodes",
    )
    add(
        "-c",
        "--child",
        metavar="NAME",
        help="Run as child service 'NAME'. Required with -u",
        completer="nothing",
    )

    add("--local", action="store_true", help="Do not launch remote nodes")
    add("--screen", action="store_true", help="Force output of all local nodes to screen")
    add("--required", action="store_true", help="Force all nodes to be required")
    add("--log", action="store_true", help="Force output of all local nodes to log")
    add("-u", "--server_uri", metavar="URI", help="URI of server. Required with -c", completer="nothing")
    add("--run_id", help="run_id of session. Required with -c", completer="nothing")
    add("--wait", action="store_true", help="wait for master to start before launching")
    add("-p", "--port", type=int, help="master port. Only valid if master is launched")
    add("--core", action="store_true", help="Launch core services only")
    add("--pid", metavar="PID_FN", help="write the roslaunch pid to filename", completer="files")
    add("-v", dest="verbose", action="store_true", help="verbose printing")
    add("--no-summary", action="store_true", help="hide summary printing")
    add("--dump-params", action="store_true", help="Dump parameters of all roslaunch files to stdout")
    add("--skip-log-check", action="store_true", help="skip check size of log folder")
    add("--ros-args", action="store_true", help="Display command-line arguments for this launch file")
    add("--disable-title", action="store_true", help="Disable setting of terminal title")

    parser.accept(
        "-w",
        "--numworkers",
        nargs=None,
        type=int,
        metavar="NUM_WORKERS",
        help="override number of worker threads. Only valid for core services.",
    )

    add(
        "-t",
        "--timeout",
        type=float,
        help="override the socket connection timeout (in seconds). Only valid for core services.",
    )
    add(
        "--master-logger-level",
        choices=("debug", "info", "warn", "error", "fatal"),
        metavar="MASTER_LOGGER_LEVEL",
        help="set rosmaster.master logger level ('debug', 'info', 'warn', 'error', 'fatal')",
    )

    add(
        "--sigint-timeout",
        type=_seconds,
        default=15.0,
        help="the SIGINT timeout used when killing nodes (in seconds).",
    )
    add(
        "--sigterm-timeout",
        type=_seconds,
        default=2.0,
        help="the SIGTERM timeout used when killing nodes if SIGINT does not stop the node (in seconds).",
    )

    _add_own_options(parser)
    return parser


def _add_own_options(parser: Parser) -> None:
    add = parser.own_options().add_argument
    add(
        "--check", action="store_true", help="report every fault of the files, with its line; status 1 if any"
    )
    add("--watch", action="store_true", help="start a node again when its file changes")
    add("--ui", action="store_true", help="show the nodes in a table: state, CPU, memory, last line")
    add("--verbose", action="store_true", help="as -v: print each file that is read")


def _seconds(text: str) -> float:
    seconds = float(text)
    if seconds <= 0:
        raise argparse.ArgumentTypeError(f"{text} is not more than 0 seconds")
    return seconds


def _warn_of_unknown(args: Iterable[str], spec: LaunchSpec) -> None:
    """Warn about arguments that no file declares: real roslaunch ignores them, but most are typos."""
    for name in args:
        if name not in spec.args:
            warn(_unknown(name, spec))


def _unknown(name: str, spec: LaunchSpec) -> str:
    return str(NotFoundError("arg", name, spec.args, "the launch file declares no such <arg>"))


def _print_args(args: list[ArgDoc]) -> None:
    required = sorted((arg for arg in args if arg.default is None), key=lambda arg: arg.name)
    optional = sorted((arg for arg in args if arg.default is not None), key=lambda arg: arg.name)
    if required:
        print("Required Arguments:")
    for arg in required:
        print(f"  {arg.name}: {arg.doc or 'undocumented'}")
    if optional:
        print("Optional Arguments:")
    for arg in optional:
        print(f'  {arg.name} (default "{arg.default}"): {arg.doc or "undocumented"}')
    if not args:
        print("No arguments.")


def _check(sources: list[LaunchSource], packages: Packages) -> int:
    """Print all errors and warnings about the files, sorted by line."""
    from minirospy.ros.roslaunch.launcher.check import find_problems, problem_line

    spec, problems = find_problems(sources, packages)
    file, _, args = sources[0]
    problems += [LaunchError(file, 0, _unknown(name, spec)) for name in args if name not in spec.args]
    found = [(error, "error") for error in problems] + [(error, "warning") for error in spec.warnings]
    for error, kind in sorted(found, key=lambda each: (each[0].file, each[0].line)):
        print(problem_line(error, kind))
    counts = f"{len(spec.files)} files, {len(spec.nodes)} nodes, {len(spec.params)} parameters"
    print(f"{counts}: {len(problems)} errors, {len(spec.warnings)} warnings")
    return 1 if problems else 0


# --- output of the options that print information


def _show_files(spec: LaunchSpec, _: object, __: Packages) -> None:
    print("\n".join(spec.files))


def _show_nodes(spec: LaunchSpec, _: object, __: Packages) -> None:
    print("\n".join(node.name for node in spec.named_runnables()))


def _show_params(spec: LaunchSpec, _: object, __: Packages) -> None:
    import yaml

    sys.stdout.write(yaml.safe_dump(spec.params, default_flow_style=False) + "\n")


def _show_command(spec: LaunchSpec, name: str, packages: Packages) -> None:
    print(shell_line(_node(spec, name), packages))


def _show_file_of(spec: LaunchSpec, name: str, _: Packages) -> None:
    print(_node(spec, name).file)


def _node(spec: LaunchSpec, name: str) -> NodeSpec:
    wanted = "/" + name.strip("/")
    for node in spec.named_runnables():
        if node.name == wanted:
            return node
    known = [node.name for node in spec.named_runnables()]
    hint = "" if not known else f"there are: {', '.join(known)}"
    raise NotFoundError("node", name, known, hint)


_SHOWS: dict[str, Callable[[LaunchSpec, str, Packages], None]] = {
    "files": _show_files,
    "nodes": _show_nodes,
    "find_node": _show_file_of,
    "dump_params": _show_params,
    "node_args": _show_command,
}
"""For each option that prints information, the function that prints it. If several are given, the first in this table
applies.
"""

COMMAND = Command("roslaunch", _parser, with_options(LaunchOptions, _roslaunch))


if __name__ == "__main__":
    sys.exit(main())
