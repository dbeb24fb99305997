"""`roslaunch`: run what a launch file says. Source: http://wiki.ros.org/roslaunch/Commandline%20Tools."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy import private_files
from minirospy.cli.command import Parser, run
from minirospy.environment import Environment
from minirospy.errors import LaunchError, MinirospyError, NotFoundError, UsageError
from minirospy.launch.command import shell_line
from minirospy.launch.load import STDIN, Source, find_files, load_sources, resolved_arg_docs
from minirospy.launch.spec import ArgDoc, LaunchSpec, NodeSpec
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.launch.runner import RunOptions

__all__ = ["main"]

_USAGE = "roslaunch [options] PACKAGE FILE [arg:=value ...]\n       roslaunch [options] FILE [FILE ...] [arg:=value ...]"


def main(argv: Sequence[str] | None = None) -> int:
    """The command; exit status as in minirospy.cli.command, 1 also where a required node died of a fault."""
    words = list(sys.argv[1:] if argv is None else argv)
    return run("roslaunch", lambda: _roslaunch(words))


def _roslaunch(words: list[str]) -> int:
    parser = _parser()
    options = parser.parse_args([word for word in words if ":=" not in word])
    args = dict(word.split(":=", 1) for word in words if ":=" in word and not word.startswith("__"))
    environment = Environment.read()
    if options.port is not None:
        if not 0 < options.port < 65536:
            parser.error(f"port {options.port} is not between 1 and 65535")
        environment = environment._replace(master_uri=f"http://{environment.uri_host}:{options.port}")
    packages = Packages(environment)
    if options.child or options.server_uri or options.run_id:
        if not (options.child and options.server_uri and options.run_id):
            parser.error("--child, --server_uri and --run_id go together")
        return _child(options, environment, packages)
    if not options.what and not options.core:
        parser.error("say what to launch: PACKAGE FILE, or one or more launch files")
    files = [STDIN] if options.what == ["-"] else find_files(options.what, packages)
    text = sys.stdin.read() if files == [STDIN] else None
    if options.ros_args:
        if text is not None:
            parser.error("--ros-args takes a file")
        _print_args(resolved_arg_docs(files[-1], args, packages))
        return 0
    sources = [Source(file, None if text is None else text.encode(), args) for file in files]
    if options.check:
        return _check(sources, packages)
    spec = load_sources(sources, packages)
    _refuse_unknown(args, spec)
    for name, show in _SHOWS.items():
        if (asked := getattr(options, name)) not in (None, False):
            show(spec, asked, packages)
            return 0
    return _run(options, spec, environment, packages, " ".join(Path(file).name for file in files))


def _run(
    options: argparse.Namespace, spec: LaunchSpec, environment: Environment, packages: Packages, name: str
) -> int:
    from minirospy.launch.output import Output
    from minirospy.launch.runner import Launcher

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
            output.say(f"... loading XML file [{file}]")
    if not options.skip_log_check:
        from minirospy.launch.output import warn_of_large_logs

        warn_of_large_logs(environment.log_dir, output)
    if not options.ui:
        return launcher.run(wait=options.wait)
    from minirospy.launch.live import LiveTable

    with LiveTable(launcher):
        return launcher.run(wait=options.wait)


def _run_options(options: argparse.Namespace, name: str) -> RunOptions:
    from minirospy.launch.process import Timeouts
    from minirospy.launch.runner import RunOptions

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
        timeouts=Timeouts(options.sigint_timeout, options.sigterm_timeout),
        master_arguments=tuple(master),
    )


def _child(options: argparse.Namespace, environment: Environment, packages: Packages) -> int:
    from minirospy.launch.child import run_child

    return run_child(
        options.child, options.server_uri, options.run_id, environment, packages, _run_options(options, "")
    )


def _parser() -> Parser:
    parser = Parser(
        prog="roslaunch",
        usage=_USAGE,
        description="Runs the nodes of launch files, and a master where there is none. Ctrl-C ends them all. "
        "Where FILE is -, it is read from standard input.",
    )
    add = parser.add_argument
    add("what", nargs="*", help=argparse.SUPPRESS)
    shows = parser.add_argument_group("without running anything")
    shows.add_argument("--nodes", action="store_true", help="list the nodes")
    shows.add_argument("--files", action="store_true", help="list the files that are read")
    shows.add_argument("--find-node", metavar="NODE", help="print the file that a node is in")
    shows.add_argument("--args", metavar="NODE", help="print the command line of a node")
    shows.add_argument("--ros-args", action="store_true", help="list the arguments of the file")
    shows.add_argument("--dump-params", action="store_true", help="print the parameters as YAML")
    shows.add_argument(
        "--check", action="store_true", help="tell every fault of the files, with its line; status 1 if any"
    )
    add("-p", "--port", type=int, help="port of the master on this machine")
    add("--wait", action="store_true", help="wait for a master instead of starting one")
    add("--local", action="store_true", help="do not start the nodes of other machines")
    add("--screen", action="store_true", help="show the output of all nodes")
    add("--log", action="store_true", help="show the output of no node: it goes to the log files")
    add("--required", action="store_true", help="end all when any node ends")
    add("--core", action="store_true", help="the master alone, if no file is given")
    add("--watch", action="store_true", help="start a node again when its file changes")
    add("--ui", action="store_true", help="show the nodes in a table: state, CPU, memory, last line")
    add("-v", "--verbose", action="store_true", help="print each file that is read")
    add("--no-summary", action="store_true", help="print no summary")
    add("--pid", metavar="FILE", help="write the process id of roslaunch to FILE")
    add("--disable-title", action="store_true", help="leave the terminal's title as it is")
    add("--skip-log-check", action="store_true", help="do not look how large the log folder is")
    add("-t", "--timeout", type=float, metavar="S", help="of a master that is started: seconds for a call")
    add(
        "--master-logger-level",
        choices=("debug", "info", "warn", "error", "fatal"),
        metavar="LEVEL",
        help="of a master that is started: what goes into its log",
    )
    add("-w", "--numworkers", type=int, metavar="N", help="accepted, without effect")
    for name, seconds in (("sigint", 15.0), ("sigterm", 2.0)):
        add(
            f"--{name}-timeout",
            type=_seconds,
            default=seconds,
            metavar="S",
            help=f"seconds that a node has to end after {name.upper()} (default: {seconds:g})",
        )
    add("-c", "--child", metavar="NAME", help="run as a part of the roslaunch at URI")
    add("-u", "--server_uri", metavar="URI", help="of the roslaunch that started this one")
    add("--run_id", metavar="ID", help="of its session")
    return parser


def _seconds(text: str) -> float:
    seconds = float(text)
    if seconds <= 0:
        raise argparse.ArgumentTypeError(f"{text} is not more than 0 seconds")
    return seconds


def _refuse_unknown(args: Iterable[str], spec: LaunchSpec) -> None:
    """Real roslaunch takes an argument that no file declares in silence: most often it is a typing error."""
    unknown = [name for name in args if name not in spec.args]
    if unknown:
        raise UsageError("; ".join(_unknown(name, spec) for name in unknown))


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


def _check(sources: list[Source], packages: Packages) -> int:
    """Print every fault and warning of the files, in the order of their lines."""
    from minirospy.launch.check import find_problems, told

    spec, problems = find_problems(sources, packages)
    file, _, args = sources[0]
    problems += [LaunchError(file, 0, _unknown(name, spec)) for name in args if name not in spec.args]
    found = [(error, "error") for error in problems] + [(error, "warning") for error in spec.warnings]
    for error, kind in sorted(found, key=lambda each: (each[0].file, each[0].line)):
        print(told(error, kind))
    counts = f"{len(spec.files)} files, {len(spec.nodes)} nodes, {len(spec.params)} parameters"
    print(f"{counts}: {len(problems)} errors, {len(spec.warnings)} warnings")
    return 1 if problems else 0


# --- what is shown of a spec


def _show_files(spec: LaunchSpec, _: object, __: Packages) -> None:
    print("\n".join(spec.files))


def _show_nodes(spec: LaunchSpec, _: object, __: Packages) -> None:
    print("\n".join(node.name for node in spec.runnables()))


def _show_params(spec: LaunchSpec, _: object, __: Packages) -> None:
    import yaml

    sys.stdout.write(yaml.safe_dump(spec.params, default_flow_style=False) + "\n")


def _show_command(spec: LaunchSpec, name: str, packages: Packages) -> None:
    print(shell_line(_node(spec, name), packages))


def _show_file_of(spec: LaunchSpec, name: str, _: Packages) -> None:
    print(_node(spec, name).file)


def _node(spec: LaunchSpec, name: str) -> NodeSpec:
    wanted = "/" + name.strip("/")
    for node in spec.runnables():
        if node.name == wanted:
            return node
    known = [node.name for node in spec.runnables()]
    hint = "" if not known else f"there are: {', '.join(known)}"
    raise NotFoundError("node", name, known, hint)


_SHOWS: dict[str, Callable[[LaunchSpec, str, Packages], None]] = {
    "files": _show_files,
    "nodes": _show_nodes,
    "find_node": _show_file_of,
    "dump_params": _show_params,
    "args": _show_command,
}
"""In this order, where several are asked for."""


if __name__ == "__main__":
    sys.exit(main())
