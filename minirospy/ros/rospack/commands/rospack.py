"""rospack and rosstack: find packages and their dependencies.

rosstack treats metapackages as packages; rospack does not. Output, error messages and exit statuses are the same as those
of ROS: http://docs.ros.org/api/rospack/html/commandline.html. The command line is parsed without argparse for speed,
because shells and scripts call `rospack find` often. Intended differences: an invalid package.xml is an error only for
packages that depend on it, conditions are evaluated, and a dependency cycle is an error only for the packages in it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import MinirospyError, NotFoundError
from minirospy.base.suggestions import did_you_mean
from minirospy.command.command import run
from minirospy.workspace.dependencies import Dependencies
from minirospy.workspace.packages import Packages, crawl_times, package_name

if TYPE_CHECKING:
    from minirospy.workspace.manifest import Export

__all__ = ["main", "rosstack"]

_OPTIONS = {"target", "attrib", "top", "lang", "length"}
_FLAGS = {"deps-only", "zombie-only"}
_MISSING = (
    "{} '{}' depends on non-existent package '{}' and rosdep claims that it is not a system dependency. "
    "Check the ROS_PACKAGE_PATH or try calling 'rosdep update'"
)
_FOOTER = """\
  Extra options:
    -q     Quiets error reports.

 If [{thing}] is omitted, the current working directory
 is used (if it contains a package.xml).
"""


class _RospackError(MinirospyError):
    """An error with the text that rospack prints."""


class _Line(NamedTuple):
    """A parsed command line."""

    verb: str
    package: str
    options: dict[str, str]


class _Verb(NamedTuple):
    """A verb. In the help, ``usage`` follows its name; ``summary`` is what `rospack help VERB` prints."""

    body: Callable[[_Line, Dependencies], None]
    usage: str
    summary: str
    takes: frozenset[str] = frozenset()
    takes_package: bool = True


class _Tool(NamedTuple):
    """A command: its name, its word for a package, and its verbs."""

    name: str
    thing: str
    verbs: dict[str, _Verb]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 1 in the same cases as ROS's rospack."""
    return _run(_Tool("rospack", "package", _VERBS), argv)


def rosstack(argv: Sequence[str] | None = None) -> int:
    """Run the command rosstack; return 1 in the same cases as ROS's rosstack."""
    return _run(_Tool("rosstack", "stack", _STACK_VERBS), argv)


def _run(tool: _Tool, argv: Sequence[str] | None) -> int:
    words = list(sys.argv[1:] if argv is None else argv)
    return run(tool.name, lambda: _dispatch(words, tool))


def _dispatch(words: list[str], tool: _Tool) -> int:
    quiet = "-q" in words
    words = [word for word in words if word != "-q"]

    def complain(kind: str, text: object) -> None:
        if not quiet:
            sys.stdout.flush()
            print(f"[{tool.name}] {kind}: {text}", file=sys.stderr)

    try:
        line = _parse(words, tool)
        if line.verb == "help":
            print(_help(tool, line.package))
            return 0
        if not line.verb:
            # Exit with 0: rospack does not treat this as a failure.
            complain("Error", f"no command given.  Try '{tool.name} help'")
            return 0
        tree = Dependencies(
            Packages(), os.environ, lambda error: complain("Warning", error), tool.name == "rosstack"
        )
        _checked(line, tool).body(line, tree)
        for package, name in tree.missing:
            complain("Error", _MISSING.format(tool.thing, package, name))
    except NotFoundError as error:
        complain("Error", _not_found(tool, line.verb, error))
    except MinirospyError as error:
        complain("Error", error)
    else:
        return 1 if tree.missing else 0
    return 1


def _parse(words: list[str], tool: _Tool) -> _Line:
    options: dict[str, str] = {}
    plain: list[str] = []
    rest = iter(words)
    wants_help = False

    for word in rest:
        name, equals, value = word.removeprefix("--").partition("=")
        if word in ("-h", "--help"):
            wants_help = True
        elif not word.startswith("-"):
            plain.append(word)
        elif not word.startswith("--") or name not in _OPTIONS | _FLAGS:
            near = did_you_mean(word.partition("=")[0], (f"--{known}" for known in sorted(_OPTIONS | _FLAGS)))
            raise _RospackError(
                f"failed to parse command-line options: unrecognised option '{word}'{near} "
                f"(`{tool.name} -h` shows what there is)"
            )
        else:
            options[name] = "" if name in _FLAGS else value if equals else next(rest, "")

    if len(plain) > 2:
        raise _RospackError(
            "failed to parse command-line options: too many positional options have been specified on the command line"
        )

    verb, package = (*plain, "", "")[:2]
    if wants_help or verb == "help":
        return _Line("help", package if verb == "help" else verb, {})
    return _Line(_ALIASES.get(verb, verb), package, options)


def _checked(line: _Line, tool: _Tool) -> _Verb:
    """Return a command line's verb. Raise _RospackError if it does not exist or does not support the options."""
    verb = tool.verbs.get(line.verb)
    if verb is None:
        raise _RospackError(f"command {line.verb} not implemented{did_you_mean(line.verb, tool.verbs)}")
    if set(line.options) - verb.takes or (line.package and not verb.takes_package):
        raise _RospackError("invalid option(s) given")
    return verb


def _not_found(tool: _Tool, verb: str, error: NotFoundError) -> str:
    text = f"{tool.thing} '{error.name}' not found"
    if verb in _SAYS_NO_SUCH:
        text = f"no such package {error.name}"
    hint = error.hint
    if error.nearest:
        return f"{text}; did you mean {' or '.join(error.nearest)}?"
    return f"{text} ({hint})" if hint else text


# --- verbs


def _package(line: _Line, *others: str, said: str = "package") -> str:
    """Return the command line's package, by default the one in the current folder.

    Raise _RospackError if no package is given or found, or if an option named in ``others`` is missing.
    """
    package = line.package or _package_here()
    if not package or not all(line.options.get(name) for name in others):
        raise _RospackError(f"no {said} given")
    return package


def _package_here() -> str:
    """Return the package that contains the current folder."""
    here = Path.cwd()
    return next(filter(None, map(package_name, (here, *here.parents))), "")


def _print_lines(lines: Iterable[object]) -> None:
    sys.stdout.writelines(f"{each}\n" for each in lines)


def _find(line: _Line, tree: Dependencies) -> None:
    print(tree.folder(_package(line)))


def _list(line: _Line, tree: Dependencies) -> None:
    _print_lines(f"{name} {folders[0]}" for name, folders in tree.copies.items())


def _list_names(line: _Line, tree: Dependencies) -> None:
    _print_lines(tree.copies)


def _list_duplicates(line: _Line, tree: Dependencies) -> None:
    for name, folders in tree.copies.items():
        if len(folders) > 1:
            print(name)
            _print_lines(f"- {folder}" for folder in folders)


def _depends(line: _Line, tree: Dependencies) -> None:
    _print_lines(tree.all(_package(line)))


def _depends1(line: _Line, tree: Dependencies) -> None:
    _print_lines(tree.direct(_package(line)))


def _depends_on(line: _Line, tree: Dependencies) -> None:
    _print_lines(tree.all_dependents(_package(line)))


def _depends_on1(line: _Line, tree: Dependencies) -> None:
    _print_lines(tree.dependents(_package(line)))


def _depends_indent(line: _Line, tree: Dependencies) -> None:
    _print_lines("  " * depth + name for depth, name in tree.tree(_package(line)))


def _depends_manifests(line: _Line, tree: Dependencies) -> None:
    print(" ".join(str(tree.manifest(name).path) for name in tree.all(_package(line))))


def _depends_msgsrv(line: _Line, tree: Dependencies) -> None:
    # Only check the package, and print nothing: rosbuild created these files when generating messages, catkin does not.
    tree.all(_package(line))
    print()


def _depends_why(line: _Line, tree: Dependencies) -> None:
    package, target = _package(line, "target", said="package or target"), line.options["target"]
    tree.folder(target)
    chains = tree.chains(package, target)
    print(f"Dependency chains from {package} to {target}:")
    _print_lines(f"* {' -> '.join(chain)} " for chain in chains)


def _rosdep(line: _Line, tree: Dependencies) -> None:
    package = _package(line)
    names = [package, *tree.all(package)]
    _print_lines(f"name: {key}" for key in sorted({key for name in names for key in tree.keys(name)}))


def _rosdep0(line: _Line, tree: Dependencies) -> None:
    _print_lines(f"name: {key}" for key in tree.keys(_package(line)))


def _vcs(line: _Line, tree: Dependencies) -> None:
    # Only check that the package exists: <versioncontrol> is a tag only in manifest.xml, not in package.xml.
    tree.folder(_package(line))


def _plugins(line: _Line, tree: Dependencies) -> None:
    package = _package(line, "attrib", said="package / attrib")
    exporters = [*tree.dependents(package), package]
    top = line.options.get("top")
    if top:
        below = {top, *tree.all(top)}
        exporters = [name for name in exporters if name in below]
    for name in exporters:
        for export in tree.manifest(name).exports:
            if export.tag == package and line.options["attrib"] in export.attributes:
                print(f"{name} {_expanded(export, line.options['attrib'], tree.folder(name))}")
                break


def _export(line: _Line, tree: Dependencies) -> None:
    package = _package(line, "lang", "attrib", said="package / lang / attrib")
    print(" ".join(_exported(line, tree, package, line.options["lang"], line.options["attrib"])))


def _exported(line: _Line, tree: Dependencies, package: str, tag: str, attribute: str) -> list[str]:
    """Return an attribute's distinct values in the exports of a package and all its dependencies."""
    own = [] if "deps-only" in line.options else [package]
    found: dict[str, None] = {}
    for name in [*own, *reversed(tree.all(package))]:
        for export in tree.manifest(name).exports:
            if export.tag == tag and attribute in export.attributes:
                found[_expanded(export, attribute, tree.folder(name))] = None
                break
    return list(found)


def _expanded(export: Export, attribute: str, folder: Path) -> str:
    return export.attributes[attribute].replace("${prefix}", str(folder))


def _langs(line: _Line, tree: Dependencies) -> None:
    disabled = os.environ.get("ROS_LANG_DISABLE", "").split(":")
    print(" ".join(name for name in tree.dependents("roslang") if name not in disabled))


def _contents(line: _Line, tree: Dependencies) -> None:
    folder = tree.folder(_package(line))
    _print_lines(name for name, folders in tree.copies.items() if folders[0].is_relative_to(folder))


def _contains(line: _Line, tree: Dependencies) -> None:
    package = _package(line)
    tree.folder(package)
    print(package)


def _flags(attribute: str, prefix: str, keep: Callable[[str], bool]) -> Callable[[_Line, Dependencies], None]:
    """Return a verb that prints the flags in <cpp> exports that ``keep`` accepts, and removes ``prefix`` from each."""

    def body(line: _Line, tree: Dependencies) -> None:
        words = " ".join(_exported(line, tree, _package(line), "cpp", attribute)).split()
        print(" ".join(dict.fromkeys(word.removeprefix(prefix) for word in words if keep(word))))

    return body


def _profile(line: _Line, tree: Dependencies) -> None:
    found = sorted(
        (each for root in tree.roots for each in crawl_times(root)), key=lambda each: -each.seconds
    )
    if "zombie-only" in line.options:
        _print_lines(each.folder for each in found if not each.has_package)
        return

    try:
        length = int(line.options.get("length", 20))
    except ValueError as error:
        raise _RospackError(f"--length={line.options['length']} is not a number") from error

    took = sum(each.seconds for each in found if each.folder in tree.roots)
    print(f"Full tree crawl took {took:.6f} seconds.")
    print("Directories marked with (*) contain no manifest.  You may")
    print("want to delete these directories.")
    print("To get just of list of directories without manifests,")
    print("re-run the profile with --zombie-only")
    print("-------------------------------------------------------------")
    _print_lines(
        f"{each.seconds:.6f} {' ' if each.has_package else '*'} {each.folder}"
        for each in (found if length < 0 else found[:length])
    )


_DEPS_ONLY = frozenset({"deps-only"})
_VERBS = {
    "cflags-only-I": _Verb(
        _flags("cflags", "-I", lambda word: word.startswith("-I")),
        "[--deps-only] [package]",
        "The include folders that packages export for C++.",
        _DEPS_ONLY,
    ),
    "cflags-only-other": _Verb(
        _flags("cflags", "", lambda word: not word.startswith("-I")),
        "[--deps-only] [package]",
        "The compiler flags that packages export for C++, other than -I.",
        _DEPS_ONLY,
    ),
    "depends": _Verb(_depends, "[package] (alias: deps)", "All packages that a package needs."),
    "depends-indent": _Verb(
        _depends_indent, "[package] (alias: deps-indent)", "All packages that a package needs, as a tree."
    ),
    "depends-manifests": _Verb(
        _depends_manifests,
        "[package] (alias: deps-manifests)",
        "The manifests of all packages that a package needs, in one line.",
    ),
    "depends-msgsrv": _Verb(
        _depends_msgsrv, "[package] (alias: deps-msgsrv)", "An empty line: rosbuild alone had more to say."
    ),
    "depends-on": _Verb(_depends_on, "[package]", "All packages that need a package."),
    "depends-on1": _Verb(_depends_on1, "[package]", "The packages that name a package in their manifest."),
    "depends-why": _Verb(
        _depends_why,
        "--target=<target> [package] (alias: deps-why)",
        "Each chain of dependencies from a package to the target.",
        frozenset({"target"}),
    ),
    "depends1": _Verb(_depends1, "[package] (alias: deps1)", "The packages that a package's manifest names."),
    "export": _Verb(
        _export,
        "[--deps-only] --lang=<lang> --attrib=<attrib> [package]",
        "The values of an attribute of <lang> tags in the exports of a package and of all that it needs.",
        frozenset({"deps-only", "lang", "attrib"}),
    ),
    "find": _Verb(_find, "[package]", "The absolute path of a package."),
    "langs": _Verb(_langs, "", "The packages that are client libraries (ROS_LANG_DISABLE leaves some out).", takes_package=False),
    "libs-only-L": _Verb(
        _flags("lflags", "-L", lambda word: word.startswith("-L")),
        "[--deps-only] [package]",
        "The library folders that packages export for C++.",
        _DEPS_ONLY,
    ),
    "libs-only-l": _Verb(
        _flags("lflags", "-l", lambda word: word.startswith("-l")),
        "[--deps-only] [package]",
        "The libraries that packages export for C++.",
        _DEPS_ONLY,
    ),
    "libs-only-other": _Verb(
        _flags("lflags", "", lambda word: not word.startswith(("-L", "-l"))),
        "[--deps-only] [package]",
        "The linker flags that packages export for C++, other than -L and -l.",
        _DEPS_ONLY,
    ),
    "list": _Verb(_list, "", "All packages and their paths.", takes_package=False),
    "list-duplicates": _Verb(
        _list_duplicates, "", "The packages that are there more than once, and where.", takes_package=False
    ),
    "list-names": _Verb(_list_names, "", "All packages.", takes_package=False),
    "plugins": _Verb(
        _plugins,
        "--attrib=<attrib> [--top=<toppkg>] [package]",
        "What packages export for a package under its name, of those that name it (or that toppkg needs).",
        frozenset({"attrib", "top"}),
    ),
    "profile": _Verb(
        _profile,
        "[--length=<length>] [--zombie-only]",
        "Which folders take how long to search, and which hold no package.",
        frozenset({"length", "zombie-only"}),
        takes_package=False,
    ),
    "rosdep": _Verb(_rosdep, "[package] (alias: rosdeps)", "All names that a package and what it needs ask for."),
    "rosdep0": _Verb(_rosdep0, "[package] (alias: rosdeps0)", "The names that a package depends on."),
    "vcs": _Verb(_vcs, "[package]", "Nothing: no package.xml says where its source is kept."),
    "vcs0": _Verb(_vcs, "[package]", "Nothing: no package.xml says where its source is kept."),
}  # fmt: skip
_STACK_VERBS = {
    **{verb: entry for verb, entry in _VERBS.items() if verb in ("find", "list", "list-names", "profile")},
    **{
        verb: entry
        for verb, entry in _VERBS.items()
        if verb.startswith("depends") and verb != "depends-msgsrv"
    },
    "contains": _Verb(_contains, "[package]", "The stack of a package, which is its own."),
    "contains-path": _Verb(_find, "[package]", "The absolute path of a package's stack."),
    "contents": _Verb(_contents, "[stack]", "The packages in the folder of a stack."),
}
_ALIASES = {
    "deps": "depends",
    "deps1": "depends1",
    "deps-indent": "depends-indent",
    "deps-manifests": "depends-manifests",
    "deps-msgsrv": "depends-msgsrv",
    "deps-why": "depends-why",
    "rosdeps": "rosdep",
    "rosdeps0": "rosdep0",
}
_SAYS_NO_SUCH = {"depends", "depends1", "depends-on", "depends-on1", "plugins", "langs"}


def _help(tool: _Tool, verb: str) -> str:
    verb = _ALIASES.get(verb, verb)
    if verb in tool.verbs:
        usage = tool.verbs[verb].usage.partition(" (alias")[0]
        return f"Usage: {tool.name} {verb} {usage}".rstrip() + f"\n\n{tool.verbs[verb].summary}"
    lines = [f"    {name} {entry.usage}".rstrip() for name, entry in sorted(tool.verbs.items())]
    usage = f"USAGE: {tool.name} <command> [options] [{tool.thing}]"
    return "\n".join([usage, "  Allowed commands:", "    help", *lines, _FOOTER.format(thing=tool.thing)])
