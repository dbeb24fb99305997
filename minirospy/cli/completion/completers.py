"""The candidates for completion: packages, files, launch arguments, names in the graph, types, whole messages.

A completer takes a :class:`Cursor` and returns unquoted candidates; `complete` selects those that match. Queries to the
graph have a short timeout: if no master responds, there are no candidates.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, cast

if TYPE_CHECKING:
    from roscpp.srv import GetLoggersResponse

    from minirospy.core.idl.load import Catalogue
    from minirospy.core.idl.spec import MessageSpec
    from minirospy.introspect.graph import Graph
    from minirospy.ros.rospack.commands.rospack import _Verb as PackVerb
    from minirospy.workspace.packages import Packages

__all__ = [
    "LIVE_SECONDS", "Completer", "Cursor", "Text", "bag_files",
    "build_targets", "exercise_work", "exercises", "files", "folders", "kinds", "launch_files",
    "launch_nodes", "launch_words", "loggers", "machines", "message_text", "message_types", "nodes",
    "nothing", "on_one_line", "package_file", "package_file_and_target", "package_folders", "package_names",
    "package_path", "parameter_value", "parameters", "pins", "prototype_types", "request_text",
    "rospack_words", "rosrun_words", "rosstack_words", "service_types", "services", "shells", "topic_type",
    "topics",
]  # fmt: skip

LIVE_SECONDS = 0.8  # timeout in seconds for the master and for nodes

_MAX_LETTERS = 1000  # maximum length, in characters, of a parameter value that is offered for completion

_LAUNCH = (".launch", ".launch.xml", ".test")


class Cursor(NamedTuple):
    """The cursor's context: the command's ``verb``, the ``given`` arguments before the cursor, and the partial ``word`` at it."""

    verb: str
    given: tuple[str, ...]
    word: str


class Text(str):
    """A candidate that the user will edit. Shells put it in quotes, instead of escaping each space with a backslash."""

    __slots__ = ()


Completer = Callable[[Cursor], Iterable[str]]


def nothing(_: Cursor) -> Iterable[str]:
    """Return no candidates: the completer for numbers, expressions and new names."""
    return ()


# --- packages and their files


def _packages() -> Packages:
    from minirospy.workspace.packages import Packages

    return Packages()


def package_names(_: Cursor) -> Iterable[str]:
    """Return the names of all packages."""
    return _packages().names()


def build_targets(cursor: Cursor) -> Iterable[str]:
    """Return the targets of catkin_make."""
    names = _packages().names()
    tests = [f"run_tests_{name}" for name in names] if cursor.word.startswith("run_tests_") else []
    return ("install", "run_tests", "test", "clean", *tests, *names)


def package_folders(cursor: Cursor) -> Iterable[str]:
    """Return ``pkg/`` first, then ``pkg/folder/``. For roscd, include the folders of logs and test results."""
    if any(not word.startswith("-") for word in cursor.given):
        return []
    package, slash, _ = cursor.word.partition("/")
    if not slash:
        return [f"{name}/" for name in (*_packages().names(), *_OWN_FOLDERS)]
    root = _OWN_FOLDERS[package]() if package in _OWN_FOLDERS else _packages().find(package)
    return [name for name in _below(root, package, cursor.word) if name.endswith("/")]


def _logs() -> Path:
    from minirospy.base.environment import Environment

    return Environment.read(host="localhost", master_uri="http://localhost:1").log_dir


def _results() -> Path:
    from minirospy.workspace.folders import results_dir

    return Path(results_dir())


_OWN_FOLDERS = {"log": _logs, "test_results": _results}


def package_file(cursor: Cursor) -> Iterable[str]:
    """Complete the package first, then the names and paths of its files."""
    if not cursor.given:
        return _packages().names()
    if len(cursor.given) > 1:
        return []
    return package_path(cursor) if "/" in cursor.word else _names_below(_packages().find(cursor.given[0]))


def package_path(cursor: Cursor) -> Iterable[str]:
    """Return the paths of files in the given package."""
    root = _packages().find(cursor.given[0])
    return [name.removeprefix("./") for name in _below(root, ".", "./" + cursor.word)]


def package_file_and_target(cursor: Cursor) -> Iterable[str]:
    """Complete the package first, then its files, then destinations."""
    return files(cursor) if len(cursor.given) > 1 else package_file(cursor)


def _names_below(root: Path, endings: str | tuple[str, ...] = "") -> list[str]:
    """Return the names of all files in a package, except hidden and compiled ones."""
    found: set[str] = set()
    for _, inner, names in os.walk(root):
        inner[:] = [name for name in inner if not name.startswith(".") and name != "__pycache__"]
        found.update(name for name in names if name.endswith(endings) and not name.startswith("."))
    return sorted(found)


def _below(root: Path, shown: str, word: str) -> list[str]:
    """Return the paths of the entries in the folder of ``word``, a path that starts with ``shown`` in place of ``root``."""
    head, _, prefix = word.rpartition("/")
    folder = root.joinpath(*head.split("/")[1:])
    assert head.split("/")[0] == shown
    return [f"{head}/{name}" for name in _entries(folder, hidden=prefix.startswith("."))]


def files(cursor: Cursor) -> Iterable[str]:
    """Return local files and folders, as a shell's completion does."""
    head, slash, prefix = cursor.word.rpartition("/")
    folder = Path(os.path.expanduser(head + slash) or ".")
    return [head + slash + name for name in _entries(folder, hidden=prefix.startswith("."))]


def bag_files(cursor: Cursor) -> Iterable[str]:
    """Return local bag files and folders."""
    return [name for name in files(cursor) if name.endswith(("/", ".bag", ".bag.active", ".mcap"))]


def exercises(cursor: Cursor) -> Iterable[str]:
    """Return the names of the course's exercises, and local YAML files."""
    from minirospy.course.exercise import built_in_names

    return [*built_in_names(), *(name for name in files(cursor) if name.endswith(("/", ".yaml", ".yml")))]


def exercise_work(cursor: Cursor) -> Iterable[str]:
    """Return local files and folders; after a package's name and a slash, that package's programs and launch files."""
    package, slash, _ = cursor.word.partition("/")
    found = list(files(cursor))
    if slash and not found and package:
        folder = _packages().find(package)
        names = {*_packages().executables(package), *_names_below(folder, _LAUNCH)}
        found = [f"{package}/{name}" for name in sorted(names)]
    return [*found, *(f"{name}/" for name in _packages().names())] if not slash else found


def folders(cursor: Cursor) -> Iterable[str]:
    """Return local folders."""
    return [name for name in files(cursor) if name.endswith("/")]


def _entries(folder: Path, *, hidden: bool) -> list[str]:
    try:
        entries = [entry for entry in os.scandir(folder) if hidden or not entry.name.startswith(".")]
    except OSError:
        return []
    # isdir() returns False, without an error, for a link to itself.
    return sorted(entry.name + "/" if os.path.isdir(entry) else entry.name for entry in entries)


def rosrun_words(cursor: Cursor) -> Iterable[str]:
    """Complete rosrun's options and packages, then the chosen package's programs.

    For the program's arguments, return files and remappings.
    """
    given = list(cursor.given)
    while given and given[0].startswith("-"):
        if given.pop(0) in ("-p", "--prefix"):
            if not given:
                return []
            given.pop(0)
    if not given:
        options = ["-h", "--help", "-p", "--prefix", "-d", "--debug"]
        return options if cursor.word.startswith("-") else package_names(cursor)
    if len(given) == 1:
        return _packages().executables(given[0])
    name, remapped, word = cursor.word.partition(":=")
    if remapped:
        private = name.startswith("_")
        return [] if private else [f"{name}:={topic}" for topic in topics(Cursor("", (), word))]
    return ["__name:=", "__ns:=", "__log:="] if cursor.word.startswith("_") else files(cursor)


def rospack_words(cursor: Cursor) -> Iterable[str]:
    """Return rospack's verbs and options, and the names of packages."""
    from minirospy.ros.rospack.commands.rospack import _VERBS

    return _pack_words(cursor, _VERBS)


def rosstack_words(cursor: Cursor) -> Iterable[str]:
    """Return rosstack's verbs and options, and the names of stacks."""
    from minirospy.ros.rospack.commands.rospack import _STACK_VERBS

    return _pack_words(cursor, _STACK_VERBS)


def _pack_words(cursor: Cursor, verbs: Mapping[str, PackVerb]) -> Iterable[str]:
    from minirospy.ros.rospack.commands.rospack import _FLAGS

    words = [word for word in cursor.given if not word.startswith("-")]
    verb = verbs.get(words[0]) if words else None
    if cursor.word.startswith("--target="):
        return [f"--target={name}" for name in _packages().names()]
    if cursor.word.startswith("-"):
        own = (f"--{name}" if name in _FLAGS else f"--{name}=" for name in sorted(verb.takes if verb else ()))
        return ["-h", "--help", "-q", *own]
    if not words or words == ["help"]:
        return [*verbs, "help"]
    return _packages().names() if verb and verb.takes_package and len(words) == 1 else []


# --- launch files


def launch_words(cursor: Cursor) -> Iterable[str]:
    """Complete packages and launch-file paths, then launch files in the chosen package.

    After the launch file, yield ``arg:=`` for each argument that it declares.
    """
    if ":=" not in cursor.word:
        if not cursor.given:
            yield from _packages().names()
            yield from launch_files(cursor)
            return
        if len(cursor.given) == 1 and not Path(cursor.given[0]).is_file():
            yield from _names_below(_packages().find(cursor.given[0]), _LAUNCH)
            return
    yield from _launch_args(cursor)
    if Path(cursor.given[0]).is_file():
        yield from launch_files(cursor)


def launch_files(cursor: Cursor) -> Iterable[str]:
    """Return local launch files, and folders."""
    return [name for name in files(cursor) if name.endswith((*_LAUNCH, "/"))]


def _launch_file(cursor: Cursor) -> str:
    file = Path(cursor.given[0])
    return str(file if file.is_file() else _packages().find_resource(*cursor.given[:2]))


def _launch_args(cursor: Cursor) -> Iterator[str]:
    from minirospy.ros.roslaunch.launcher.arg_docs import describe_args

    name, assigned, _ = cursor.word.partition(":=")
    for arg in describe_args(_launch_file(cursor)):
        if not assigned:
            yield f"{arg.name}:="
        elif arg.name == name and arg.default and "$(" not in arg.default:
            truth = arg.default.lower() in ("true", "false")
            yield from (f"{name}:={value}" for value in (("true", "false") if truth else (arg.default,)))


def launch_nodes(cursor: Cursor) -> Iterable[str]:
    """Return the nodes of the launch file, for `roslaunch PACKAGE FILE --args NODE`."""
    from minirospy.ros.roslaunch.launcher.arg_docs import describe_args
    from minirospy.ros.roslaunch.launcher.load import LaunchSource, load_sources

    if not cursor.given:
        return []
    file = _launch_file(cursor)
    # Set missing arguments to "" and collect errors in a list; a missing argument or an error would otherwise hide nodes.
    values = {arg.name: "" for arg in describe_args(file) if arg.default is None}
    spec = load_sources([LaunchSource(file, None, values)], _packages(), problems=[])
    return _as_typed((node.name for node in spec.named_runnables()), cursor.word)


# --- graph


def _live(ask: Callable[[Graph], Iterable[str]]) -> list[str]:
    """Return the names from ``ask``, which queries the master and nodes, or [] if that takes longer than LIVE_SECONDS."""
    import threading

    from minirospy.introspect.graph import Graph

    answers: list[list[str]] = []

    def work() -> None:
        with contextlib.suppress(Exception), Graph.open("rostopic") as graph:
            answers.append(list(ask(graph)))

    # Use a thread, because host name lookups have no timeout.
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(LIVE_SECONDS)
    return answers[0] if answers else []


def _as_typed(names: Iterable[str], word: str) -> list[str]:
    """Return global names; keep their leading slash only if ``word`` starts with one."""
    return [name.removeprefix("/") for name in names] if word and not word.startswith("/") else list(names)


def topics(cursor: Cursor) -> Iterable[str]:
    """Return the topics; for `echo` and `type`, also the fields of their messages."""
    from minirospy.introspect.topics import find_topic, topic_names

    fields = cursor.verb in ("echo", "type") and "/" in cursor.word[1:]

    def ask(graph: Graph) -> list[str]:
        found = _as_typed((name for name in topic_names(graph) if name not in cursor.given), cursor.word)
        if not fields or any(name.startswith(cursor.word) for name in found):
            return found
        parent = cursor.word.rpartition("/")[0]
        holder = find_topic(graph, graph.resolve(parent))
        return [f"{parent}/{name}" for name in _fields(holder.type, holder.path)] if holder else []

    return _live(ask)


def nodes(cursor: Cursor) -> Iterable[str]:
    """Return the nodes that are not yet on the command line."""
    from minirospy.introspect.nodes import list_nodes

    names = _live(list_nodes)
    return _as_typed((name for name in names if name not in cursor.given), cursor.word)


def machines(_: Cursor) -> Iterable[str]:
    """Return the names of the hosts that nodes run on."""
    from minirospy.introspect.graph import node_host
    from minirospy.introspect.nodes import list_nodes

    return _live(
        lambda graph: sorted({node_host(n.uri) or "" for n in graph.addresses(list_nodes(graph))} - {""})
    )


def services(cursor: Cursor) -> Iterable[str]:
    """Return the services."""
    from minirospy.introspect.services import list_services

    return _as_typed(_live(lambda graph: [service.name for service in list_services(graph)]), cursor.word)


def parameters(cursor: Cursor) -> Iterable[str]:
    """Return the parameters."""
    from minirospy.introspect.parameters import list_parameters

    return _as_typed(_live(list_parameters), cursor.word)


def parameter_value(cursor: Cursor) -> Iterable[str]:
    """Return a parameter's current value, which the user can edit, for `rosparam set PARAMETER`."""
    from minirospy.introspect.parameters import get_parameter
    from minirospy.introspect.values import format_value

    if len(cursor.given) != 1:
        return []
    ask = cursor.given[0]
    found = _live(lambda graph: [format_value(get_parameter(graph, graph.resolve(ask))).removesuffix("\n")])
    # Write a list or dictionary on one line.
    # Omit long values: nobody edits a whole robot description on a command line.
    return [on_one_line(Text(text)) for text in found if len(text) <= _MAX_LETTERS]


def loggers(cursor: Cursor) -> Iterable[str]:
    """Return the loggers of a node, for `rosconsole get NODE`."""
    from minirospy.introspect.services import call_service, fill_request

    if not cursor.given:
        return []
    type_ = "roscpp/GetLoggers"

    def ask(graph: Graph) -> list[str]:
        service = graph.resolve(cursor.given[0]) + "/get_loggers"
        response = call_service(graph, service, type_, fill_request(type_, []))
        return sorted(each.name for each in cast("GetLoggersResponse", response).loggers)

    return _live(ask)


# --- types and message text


def _catalogue() -> Catalogue:
    from minirospy.core.idl.load import Catalogue

    return Catalogue(_packages().folders())


def _types(cursor: Cursor, kind: str, inside: tuple[str, ...]) -> Iterable[str]:
    """Complete a type in two steps, ``pkg/`` and then ``pkg/Type``, because a list of all types would be too long.

    For `rosmsg show`, `info` and `md5`, return type names without the package if no package fits.
    """
    from minirospy.introspect.interfaces import Interfaces, Kind

    package, slash, _ = cursor.word.partition("/")
    packages = _packages()
    if slash:
        return Interfaces(packages, Kind(kind)).in_package(package)
    found = [
        f"{name}/"
        for name, root in sorted(packages.folders().items())
        if name.startswith(package) and any((root / folder).is_dir() for folder in inside)
    ]
    if found or cursor.verb not in ("show", "info", "md5"):
        return found
    return sorted({type_.partition("/")[2] for type_ in Interfaces(packages, Kind(kind)).all()})


def message_types(cursor: Cursor) -> Iterable[str]:
    """Return message types."""
    return _types(cursor, "msg", ("msg", "action"))


def service_types(cursor: Cursor) -> Iterable[str]:
    """Return service types."""
    return _types(cursor, "srv", ("srv",))


def prototype_types(cursor: Cursor) -> Iterable[str]:
    """Return message or service types, as chosen by the previous word, for `rosmsg-proto msg|srv`."""
    return service_types(cursor) if cursor.given[:1] == ("srv",) else message_types(cursor)


def topic_type(cursor: Cursor) -> Iterable[str]:
    """Return the topic's type, or all types if it is unknown, for `rostopic pub TOPIC`."""
    if not cursor.given:
        return message_types(cursor)

    def ask(graph: Graph) -> list[str]:
        type_ = graph.master.get_topic_types().get(graph.resolve(cursor.given[0]), "*")
        return [] if type_ == "*" else [type_]

    return _live(ask) or message_types(cursor)


def message_text(cursor: Cursor) -> Iterable[str]:
    """Return a complete message for editing, for `rostopic pub TOPIC TYPE`."""
    if len(cursor.given) != 2:
        return []
    catalogue = _catalogue()
    return [_text(catalogue.message(cursor.given[1]), catalogue)]


def request_text(cursor: Cursor) -> Iterable[str]:
    """Return a complete request for editing, for `rosservice call SERVICE`."""
    from minirospy.introspect.services import service_type

    if len(cursor.given) != 1:
        return []
    found = _live(lambda graph: [service_type(graph, graph.resolve(cursor.given[0]))])
    if not found:
        return []
    catalogue = _catalogue()
    specs = catalogue.services(found[0].partition("/")[0])
    return [_text(spec.request, catalogue) for spec in specs if spec.full_name == found[0]]


def _text(spec: MessageSpec, catalogue: Catalogue) -> Text:
    from minirospy.introspect.prototype import prototype

    # Write empty bytes as []: an interactive shell would replace !! with the previous command, even in double quotes.
    return Text(prototype(spec, catalogue).replace('!!binary ""', "[]"))


def _fields(type_: str, path: str) -> list[str]:
    """Return the names of the fields inside the field ``path`` of a message type."""
    catalogue = _catalogue()
    spec = catalogue.message(type_)
    for step in filter(None, path.split("/")):
        name = step.partition("[")[0]
        (inner,) = (field.type for field in spec.fields if field.name == name)
        if inner.base in ("time", "duration"):
            return ["secs", "nsecs"]
        spec = catalogue.message(inner.base)
    return [
        field.name if field.type.is_primitive or field.type.is_array else f"{field.name}/"
        for field in spec.fields
    ]


def on_one_line(text: str) -> str:
    """Rewrite a message's YAML on one line."""
    if not isinstance(text, Text) or "\n" not in text:
        return text
    import yaml

    def flow(node: yaml.Node | None) -> None:
        if isinstance(node, yaml.CollectionNode):
            node.flow_style = True
            for child in node.value:
                for each in child if isinstance(child, tuple) else (child,):
                    flow(each)
        elif isinstance(node, yaml.ScalarNode) and "\n" in node.value:
            node.style = '"'

    # Compose YAML nodes: loading and dumping the values could change them, for example a field named `on` to `true`.
    root = yaml.compose(text, yaml.SafeLoader)
    flow(root)
    return Text(
        yaml.serialize(root, Dumper=yaml.SafeDumper, width=sys.maxsize, allow_unicode=True).removesuffix("\n")
    )


# --- fixed choices


def pins(cursor: Cursor) -> Iterable[str]:
    """Return the wired pins of the virtual board; for `press`, only those with buttons."""
    from minirospy.board.model import BUTTONS, LEDS

    return map(str, BUTTONS if cursor.verb in ("press", "release") else (*LEDS, *BUTTONS))


def dashboard_views(_: Cursor) -> Iterable[str]:
    """Return the dashboard's views, and the layouts that are not named like a view."""
    from minirospy.web.dashboard.views import LAYOUTS, VIEWS

    return dict.fromkeys((*VIEWS, *LAYOUTS))


def dashboard_layouts(_: Cursor) -> Iterable[str]:
    """Return the layouts built into the dashboard's page."""
    from minirospy.web.dashboard.views import LAYOUTS

    return LAYOUTS


def shells(_: Cursor) -> Iterable[str]:
    """Return the shells that `minirospy shell` supports."""
    from minirospy.workspace.setup_files import SHELLS

    return SHELLS


def kinds(_: Cursor) -> Iterable[str]:
    """Return the kinds of types, for `rosmsg-proto`."""
    return ("msg", "srv")
