"""What TAB offers: packages, files, launch arguments, what is in the graph, types, whole messages.

A :class:`Place` comes in, candidates go out, unquoted; `complete` picks those that fit. Nothing of a graph is waited
for longer than a person at the keyboard waits: without a master, or with one that is silent, there is nothing to offer.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from minirospy.idl.load import Catalogue
    from minirospy.introspect.graph import Graph
    from minirospy.workspace.packages import Packages

__all__ = ["BY_HAND", "PLAIN", "SOURCES", "Place", "Source", "on_one_line"]

LIVE_SECONDS = 0.8
"""How long a master, or a node, may take."""

PLAIN = re.compile(r"[\w@%+=:,./~-]*\Z")
"""What no shell reads as more than a word."""

_LAUNCH = (".launch", ".launch.xml", ".test")


class Place(NamedTuple):
    """Where the cursor is: in an argument of ``verb``, after the arguments ``given``, ``word`` begun."""

    verb: str
    given: tuple[str, ...]
    word: str


Source = Callable[[Place], Iterable[str]]


# --- packages and their files


def _packages() -> Packages:
    from minirospy.workspace.packages import Packages

    return Packages()


def _package_names(_: Place) -> Iterable[str]:
    return _packages().names()


def _build_targets(place: Place) -> Iterable[str]:
    """What catkin_make makes."""
    return ("install", "run_tests", "clean", *_package_names(place))


def _package_folders(place: Place) -> Iterable[str]:
    """``pkg/``, then ``pkg/folder/``."""
    if any(not word.startswith("-") for word in place.given):
        return []
    package, slash, _ = place.word.partition("/")
    if not slash:
        return [f"{name}/" for name in _packages().names()]
    root = _packages().find(package)
    return [name for name in _below(root, package, place.word) if name.endswith("/")]


def _package_file(place: Place) -> Iterable[str]:
    """A package, then the name of a file anywhere in it, or its path."""
    if not place.given:
        return _packages().names()
    if len(place.given) > 1:
        return []
    root = _packages().find(place.given[0])
    if "/" in place.word:
        return [name.removeprefix("./") for name in _below(root, ".", "./" + place.word)]
    return _names_below(root)


def _package_file_target(place: Place) -> Iterable[str]:
    return _files(place) if len(place.given) > 1 else _package_file(place)


def _names_below(root: Path, endings: str | tuple[str, ...] = "") -> list[str]:
    """The names of all files in a package, hidden ones and compiled ones left out."""
    found: set[str] = set()
    for _, folders, names in os.walk(root):
        folders[:] = [name for name in folders if not name.startswith(".") and name != "__pycache__"]
        found.update(name for name in names if name.endswith(endings) and not name.startswith("."))
    return sorted(found)


def _below(root: Path, shown: str, word: str) -> list[str]:
    """What lies in the folder that ``word`` is in; ``shown`` stands for ``root`` at its beginning."""
    head, _, begun = word.rpartition("/")
    folder = root.joinpath(*head.split("/")[1:])
    assert head.split("/")[0] == shown
    return [f"{head}/{name}" for name in _entries(folder, hidden=begun.startswith("."))]


def _files(place: Place) -> Iterable[str]:
    """Files and folders of this computer, as shells complete them."""
    head, slash, begun = place.word.rpartition("/")
    folder = Path(os.path.expanduser(head + slash) or ".")
    return [head + slash + name for name in _entries(folder, hidden=begun.startswith("."))]


def _entries(folder: Path, *, hidden: bool) -> list[str]:
    try:
        entries = [entry for entry in os.scandir(folder) if hidden or not entry.name.startswith(".")]
    except OSError:
        return []
    return sorted(entry.name + "/" if entry.is_dir() else entry.name for entry in entries)


def _rosrun(place: Place) -> Iterable[str]:
    """Options of rosrun, a package, a program of it; then what the program takes: files, remaps."""
    given = list(place.given)
    while given and given[0].startswith("-"):
        if given.pop(0) in ("-p", "--prefix"):
            if not given:
                return []
            given.pop(0)
    if not given:
        return (
            ["-h", "--help", "-p", "--prefix", "-d", "--debug"]
            if place.word[:1] == "-"
            else _package_names(place)
        )
    if len(given) == 1:
        return _packages().executables(given[0])
    return ["__name:=", "__ns:=", "__log:="] if place.word.startswith("_") else _files(place)


def _rospack(place: Place) -> Iterable[str]:
    """A verb of rospack, its options, a package."""
    from minirospy.cli.rospack import _FLAGS, _VERBS

    words = [word for word in place.given if not word.startswith("-")]
    verb = _VERBS.get(words[0]) if words else None
    if place.word.startswith("--target="):
        return [f"--target={name}" for name in _packages().names()]
    if place.word.startswith("-"):
        own = (f"--{name}" if name in _FLAGS else f"--{name}=" for name in sorted(verb.takes if verb else ()))
        return ["-h", "--help", "-q", *own]
    if not words or words == ["help"]:
        return [*_VERBS, "help"]
    return _packages().names() if verb and verb.takes_package and len(words) == 1 else []


def _launch_words(place: Place) -> Iterable[str]:
    """A package and a launch file of it, or a path of one; then ``arg:=`` of what the file declares."""
    if ":=" not in place.word:
        if not place.given:
            yield from _packages().names()
            yield from _launch_paths(place)
            return
        if len(place.given) == 1 and not Path(place.given[0]).is_file():
            yield from _names_below(_packages().find(place.given[0]), _LAUNCH)
            return
    yield from _launch_args(place)
    if Path(place.given[0]).is_file():
        yield from _launch_paths(place)


def _launch_paths(place: Place) -> Iterable[str]:
    return [name for name in _files(place) if name.endswith((*_LAUNCH, "/"))]


def _launch_args(place: Place) -> Iterator[str]:
    from minirospy.launch.load import describe_args

    file = Path(place.given[0])
    if not file.is_file():
        file = _packages().find_resource(*place.given[:2])
    name, assigned, _ = place.word.partition(":=")
    for arg in describe_args(str(file)):
        if not assigned:
            yield f"{arg.name}:="
        elif arg.name == name and arg.default and PLAIN.match(arg.default):
            truth = arg.default.lower() in ("true", "false")
            yield from (f"{name}:={value}" for value in (("true", "false") if truth else (arg.default,)))


# --- the graph


def _live(ask: Callable[[Graph], Iterable[str]]) -> list[str]:
    """What the master, and the nodes, answer; nothing where that takes longer than a TAB may."""
    import threading

    from minirospy.introspect.graph import Graph

    answers: list[list[str]] = []

    def work() -> None:
        with contextlib.suppress(Exception), Graph.open("rostopic") as graph:
            answers.append(list(ask(graph)))

    # A thread, because no timeout reaches into the look-up of a host's name.
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(LIVE_SECONDS)
    return answers[0] if answers else []


def _as_typed(names: Iterable[str], word: str) -> list[str]:
    """Global names, with their first slash only where that is how they are being typed."""
    return [name.removeprefix("/") for name in names] if word and not word.startswith("/") else list(names)


def _topics(place: Place) -> Iterable[str]:
    from minirospy.introspect.topics import find_topic, topic_names

    fields = place.verb in ("echo", "type") and "/" in place.word[1:]

    def ask(graph: Graph) -> list[str]:
        found = _as_typed((name for name in topic_names(graph) if name not in place.given), place.word)
        if not fields or any(name.startswith(place.word) for name in found):
            return found
        parent = place.word.rpartition("/")[0]
        holder = find_topic(graph, graph.resolve(parent))
        return [f"{parent}/{name}" for name in _fields(holder.type, holder.path)] if holder else []

    return _live(ask)


def _nodes(place: Place) -> Iterable[str]:
    from minirospy.introspect.nodes import list_nodes

    names = _live(list_nodes)
    return _as_typed((name for name in names if name not in place.given), place.word)


def _machines(_: Place) -> Iterable[str]:
    from minirospy.introspect.graph import node_host
    from minirospy.introspect.nodes import list_nodes

    return _live(
        lambda graph: sorted({node_host(n.uri) or "" for n in graph.addresses(list_nodes(graph))} - {""})
    )


def _services(place: Place) -> Iterable[str]:
    from minirospy.introspect.services import list_services

    return _as_typed(_live(lambda graph: [service.name for service in list_services(graph)]), place.word)


def _parameters(place: Place) -> Iterable[str]:
    from minirospy.introspect.parameters import list_parameters

    return _as_typed(_live(list_parameters), place.word)


def _parameter_value(place: Place) -> Iterable[str]:
    """`rosparam set PARAMETER`: the value that it has, to be changed."""
    from minirospy.introspect.parameters import get_parameter
    from minirospy.introspect.values import format_value

    if len(place.given) != 1:
        return []
    ask = place.given[0]
    found = _live(lambda graph: [format_value(get_parameter(graph, graph.resolve(ask))).removesuffix("\n")])
    # A list or a table is read from one line as well.
    return [on_one_line(text) for text in found]


def _loggers(place: Place) -> Iterable[str]:
    """`rosconsole get NODE`: the loggers of the node."""
    from minirospy.introspect.services import call_service, fill_request

    if not place.given:
        return []
    type_ = "roscpp/GetLoggers"

    def ask(graph: Graph) -> list[str]:
        service = graph.resolve(place.given[0]) + "/get_loggers"
        return sorted(
            each.name for each in call_service(graph, service, type_, fill_request(type_, [])).loggers
        )

    return _live(ask)


# --- types, and texts of messages


def _catalogue() -> Catalogue:
    from minirospy.idl.load import Catalogue

    return Catalogue(_packages().folders())


def _types(word: str, kind: str, folders: tuple[str, ...]) -> Iterable[str]:
    """``pkg/``, then ``pkg/Type``: all types at once would be hundreds."""
    from minirospy.introspect.interfaces import Interfaces, Kind

    package, slash, _ = word.partition("/")
    packages = _packages()
    if slash:
        return Interfaces(packages, Kind(kind)).in_package(package)
    return [
        f"{name}/"
        for name, root in sorted(packages.folders().items())
        if name.startswith(word) and any((root / folder).is_dir() for folder in folders)
    ]


def _message_types(place: Place) -> Iterable[str]:
    return _types(place.word, "msg", ("msg", "action"))


def _service_types(place: Place) -> Iterable[str]:
    return _types(place.word, "srv", ("srv",))


def _topic_type(place: Place) -> Iterable[str]:
    """`rostopic pub TOPIC`: the type that the topic has, any where it has none."""
    if not place.given:
        return _message_types(place)

    def ask(graph: Graph) -> list[str]:
        type_ = graph.master.get_topic_types().get(graph.resolve(place.given[0]), "*")
        return [] if type_ == "*" else [type_]

    return _live(ask) or _message_types(place)


def _message_text(place: Place) -> Iterable[str]:
    """`rostopic pub TOPIC TYPE`: a whole message to be changed."""
    if len(place.given) != 2:
        return []
    catalogue = _catalogue()
    from minirospy.introspect.prototype import prototype

    return [prototype(catalogue.message(place.given[1]), catalogue)]


def _request_text(place: Place) -> Iterable[str]:
    """`rosservice call SERVICE`: a whole request to be changed."""
    from minirospy.introspect.services import service_type

    if len(place.given) != 1:
        return []
    found = _live(lambda graph: [service_type(graph, graph.resolve(place.given[0]))])
    if not found:
        return []
    catalogue = _catalogue()
    specs = catalogue.services(found[0].partition("/")[0])
    from minirospy.introspect.prototype import prototype

    return [prototype(spec.request, catalogue) for spec in specs if spec.full_name == found[0]]


def _fields(type_: str, path: str) -> list[str]:
    """The fields of a message type's field ``path``."""
    catalogue = _catalogue()
    spec = catalogue.message(type_)
    for step in filter(None, path.split("/")):
        name = step.partition("[")[0]
        (inner,) = (field.type for field in spec.fields if field.name == name)
        if inner.base in ("time", "duration"):
            return ["secs", "nsecs"]
        spec = catalogue.message(inner.base)
    return [field.name for field in spec.fields]


def on_one_line(text: str) -> str:
    """A message's text on one line, as YAML allows it too."""
    if "\n" not in text:
        return text
    import yaml

    flow = yaml.safe_dump(yaml.safe_load(text), default_flow_style=True, sort_keys=False, width=sys.maxsize)
    return str(flow).removesuffix("\n")


# --- commands that read their words by hand, and what words are called in parsers

BY_HAND: dict[str, Source] = {
    "roscd": _package_folders,
    "rospd": _package_folders,
    "rosls": _package_folders,
    "rosed": _package_file,
    "roscp": _package_file_target,
    "rosrun": _rosrun,
    "rospack": _rospack,
}

SOURCES: dict[str, Source] = {
    "topic": _topics,
    "topics": _topics,
    "node": _nodes,
    "nodes": _nodes,
    "machine": _machines,
    "service": _services,
    "parameter": _parameters,
    "package": _package_names,
    "packages": _package_names,
    "dependencies": _package_names,
    "targets": _build_targets,
    "pkg": _package_names,
    "pkgs": _package_names,
    "file": _files,
    "files": _files,
    "textfile": _files,
    "binfile": _files,
    "directory": _files,
    "workspace": _files,
    "type": _message_types,
    "roslaunch what": _launch_words,
    "rostest what": _launch_words,
    "rostopic namespace": _topics,
    "rostopic type": _topic_type,
    "rostopic args": _message_text,
    "rosnode namespace": _nodes,
    "rosservice namespace": _services,
    "rosservice type": _service_types,
    "rosservice args": _request_text,
    "rosparam namespace": _parameters,
    "rosparam value": _parameter_value,
    "logger": _loggers,
    "rossrv type": _service_types,
}
"""The name of an argument or an option's value, alone or after its command's -> what it is completed with."""
