"""`roslaunch`: run what a launch file says. Source: http://wiki.ros.org/roslaunch/Commandline%20Tools."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.cli.command import Parser, run
from minirospy.environment import Environment
from minirospy.errors import MinirospyError, NotFoundError, UsageError
from minirospy.launch.load import describe_args, load_files, load_text
from minirospy.launch.runner import Launcher, node_command
from minirospy.launch.spec import ArgDoc, LaunchSpec
from minirospy.workspace.packages import Packages

__all__ = ["main"]


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
        environment = environment._replace(master_uri=f"http://localhost:{options.port}")
    packages = Packages(environment)
    if not options.what:
        parser.error("say what to launch: PACKAGE FILE, or one or more launch files")
    if options.what == ["-"]:
        spec = load_text(sys.stdin.read(), args, packages)
    else:
        files = _files(options.what, packages)
        if options.ros_args:
            _print_args(describe_args(files[0]))
            return 0
        spec = load_files(files, args, packages)
    _refuse_unknown(args, spec)
    if options.nodes:
        print("\n".join(node.name for node in spec.nodes))
    elif options.files:
        print("\n".join(spec.files))
    elif options.dump_params:
        import yaml

        print(yaml.safe_dump(spec.params, default_flow_style=None))
    elif options.args is not None:
        _print_command(spec, options.args, packages)
    else:
        return Launcher(spec, environment, packages, screen=options.screen).run(wait=options.wait)
    return 0


def _parser() -> Parser:
    parser = Parser(
        prog="roslaunch",
        usage="roslaunch [options] PACKAGE FILE [arg:=value ...]\n       roslaunch [options] FILE [FILE ...] [arg:=value ...]",
        description="Runs the nodes of launch files, and a master where there is none. Ctrl-C ends them all.",
    )
    parser.add_argument("what", nargs="*", help=argparse.SUPPRESS)
    parser.add_argument("-p", "--port", type=int, help="port of the master on this machine")
    parser.add_argument("--wait", action="store_true", help="wait for a master instead of starting one")
    parser.add_argument("--screen", action="store_true", help="show the output of all nodes")
    parser.add_argument("--nodes", action="store_true", help="list the nodes, run nothing")
    parser.add_argument("--files", action="store_true", help="list the files that are read, run nothing")
    parser.add_argument("--ros-args", action="store_true", help="list the arguments of the file, run nothing")
    parser.add_argument(
        "--dump-params", action="store_true", help="print the parameters as YAML, run nothing"
    )
    parser.add_argument("--args", metavar="NODE", help="print the command line of a node, run nothing")
    return parser


def _files(what: list[str], packages: Packages) -> list[str]:
    """The launch files that the command line names. Raises MinirospyError."""
    if len(what) == 2 and not Path(what[0]).is_file():
        package, file = what
        try:
            return [str(packages.find_resource(package, file))]
        except NotFoundError as error:
            if error.kind == "package":
                raise MinirospyError(
                    f"[{file}] is neither a launch file in package [{package}] nor is [{package}] a launch "
                    f"file name: {error}"
                ) from error
            raise
    for file in what:
        if not Path(file).is_file():
            raise MinirospyError(
                f"[{file}] is not a launch file name: type roslaunch PACKAGE FILE, or a path"
            )
    return what


def _refuse_unknown(args: dict[str, str], spec: LaunchSpec) -> None:
    """Real roslaunch takes an argument that no file declares in silence: most often it is a typing error."""
    for name in args:
        if name not in spec.args:
            raise UsageError(
                str(NotFoundError("arg", name, spec.args, "the launch file declares no such <arg>"))
            )


def _print_args(args: list[ArgDoc]) -> None:
    required = [arg for arg in args if arg.default is None]
    optional = [arg for arg in args if arg.default is not None]
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


def _print_command(spec: LaunchSpec, name: str, packages: Packages) -> None:
    wanted = "/" + name.strip("/")
    for node in spec.nodes:
        if node.name == wanted or node.base_name == name:
            namespace = node.namespace.rstrip("/")
            prefix = f"ROS_NAMESPACE={namespace} " if namespace else ""
            print(prefix + " ".join(node_command(node, packages)))
            return
    raise NotFoundError("node", name, [node.name for node in spec.nodes])


if __name__ == "__main__":
    sys.exit(main())
