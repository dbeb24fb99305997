"""Evaluate a CMakeLists.txt: return the commands that CMake would run, with variables expanded.

Evaluates ``if``, ``foreach``, ``macro``, ``function``, ``include``, ``add_subdirectory``, ``return``, and the commands
that set variables; yields all other commands. An unset variable is empty, and false, as in CMake. Source:
https://cmake.org/cmake/help/latest/manual/cmake-commands.7.html.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from minirospy.base.errors import BuildError
from minirospy.workspace.cmake import Statement, Word, keyword_arguments, parse_cmake

__all__ = ["Command", "run_cmake"]

_VARIABLE = re.compile(r"(?<!\\)\$(ENV)?\{([^${}]*)\}")
_FALSE = re.compile(r"(?i)^(0|off|no|false|n|ignore|notfound|.*-notfound|)$")
_TRUE = re.compile(r"(?i)^(on|yes|true|y|[+-]?(?=.*[1-9])\d*(?:\.\d*)?)$")
_HERE = {"catkin", "rostest", "rosunit", "roslaunch", "PythonInterp", "Python3"}
"""Optional packages that Python packages may require, and that are reported as found."""
_ROS_2 = re.compile(
    r"(ament|rcl|rosidl)"
)  # prefixes of ROS 2 packages, for a CMakeLists.txt that supports both ROS 1 and ROS 2
_CHECKS = ("check_include_file", "check_include_files", "check_include_file_cxx")
_FINDERS = ("find_package_handle_standard_args", "pkg_check_modules", "pkg_search_module")
_MAX_LOOPS = 100_000  # maximum number of iterations of foreach() with RANGE
# maximum nesting of files and macros; a file nested more deeply must be including itself
_MAX_DEPTH = 40


class Command(NamedTuple):
    """A command that is run: its name in lower case, its arguments, and its location (line, file and folder)."""

    name: str
    arguments: tuple[str, ...]
    line: int
    file: Path
    folder: Path


class _Macro(NamedTuple):
    """A macro or function, as defined by ``macro()`` or ``function()``, and the file that defines it."""

    has_scope: bool
    parameters: list[str]
    body: tuple[Statement, ...]
    file: Path


class _Leave(Exception):
    """Raised to run ``return()``, ``break()`` or ``continue()``."""


def run_cmake(
    file: Path, variables: Mapping[str, str], own: Collection[str] = frozenset()
) -> Iterator[Command]:
    """Run a CMakeLists.txt; yield its commands.

    ``variables`` holds the initial variables; a key ``ENV{X}`` sets an environment variable. Raise BuildError if the file
    does not exist, a bracket is not closed, or a condition or pattern cannot be parsed.
    Commands in ``own`` are yielded even if the file defines a macro of that name.
    """
    return _Run(file.parent, dict(variables), {}, 0, own).file(file)


def _items(text: str) -> list[str]:
    return [item for item in text.split(";") if item]


def _escaped(text: str) -> str:
    """Escape a value so that expansion leaves it unchanged."""
    return text.replace("\\", "\\\\").replace("$", "\\$")


def _substituted(statements: Sequence[Statement], values: Mapping[str, str]) -> tuple[Statement, ...]:
    """Substitute a macro's arguments in its commands as text, as CMake does before it expands variables."""

    def value(match: re.Match[str]) -> str:
        given = None if match[1] else values.get(match[2])
        return match[0] if given is None else _escaped(given)

    def words(statement: Statement) -> tuple[Word, ...]:
        return tuple(word._replace(text=_VARIABLE.sub(value, word.text)) for word in statement.words)

    return tuple(
        each._replace(words=words(each), body=_substituted(each.body, values)) for each in statements
    )


class _Run:
    """Runs the commands of a folder.

    ``_known``: the variables of the current scope; ``_raised``: those that ``PARENT_SCOPE`` sets in the enclosing scope;
    ``_macros``: the defined macros and functions; ``_own``: names that macros and functions cannot redefine.
    """

    def __init__(
        self,
        folder: Path,
        known: dict[str, str],
        macros: dict[str, _Macro],
        depth: int,
        own: Collection[str],
    ) -> None:
        self._folder = folder
        self._known = known
        self._raised: dict[str, str] = {}
        self._macros = macros
        self._depth = depth
        self._own = own

        self._readers: dict[str, Callable[[Statement, list[str], Path], Iterator[Command]]] = {
            "if": self._if,
            "foreach": self._foreach,
            "while": lambda statement, arguments, file: iter(()),
            "macro": self._define,
            "function": self._define,
            "include": self._include,
            "find_package": self._find,
            "add_subdirectory": self._subdirectory,
            **dict.fromkeys(("return", "break", "continue"), self._leave),
        }

        self._setters: dict[str, Callable[[list[str]], None]] = {
            "project": self._project,
            "set": self._set,
            "unset": self._unset,
            "option": self._option,
            "list": self._list,
            "string": self._string,
            "file": self._file,
            **dict.fromkeys(_FINDERS, self._handle_standard_args),
            "get_filename_component": self._filename,
            **dict.fromkeys(_CHECKS, self._check),
        }

    def file(self, file: Path) -> Iterator[Command]:
        """Yield the commands of a file. Raise BuildError if it cannot be read."""
        try:
            text = file.read_text(encoding="utf-8", errors="replace")
        except OSError as error:
            raise BuildError(str(file), 0, error.strerror or str(error)) from error
        if "\0" in text:
            raise BuildError(str(file), 1, "is not UTF-8 text")
        yield from self._body(parse_cmake(text, str(file)), file)

    def _body(self, statements: Sequence[Statement], file: Path) -> Iterator[Command]:
        """Yield the commands of a file or function, up to its ``return()``."""
        with self._nested(statements, file), suppress(_Leave):
            yield from self._run(statements, file)

    @contextmanager
    def _nested(self, statements: Sequence[Statement], file: Path) -> Iterator[None]:
        """Count a nesting level for the duration of the context. Raise BuildError if there are too many."""
        self._depth += 1
        if self._depth > _MAX_DEPTH:
            raise BuildError(str(file), statements[0].line if statements else 0, "includes or calls itself")
        try:
            yield
        finally:
            self._depth -= 1

    def _run(self, statements: Sequence[Statement], file: Path) -> Iterator[Command]:
        for statement in statements:
            arguments = self._arguments(statement.words)
            if statement.name in self._macros:
                yield from self._call(statement.name, arguments)
            elif statement.name in self._readers:
                yield from self._readers[statement.name](statement, arguments, file)
            else:
                if statement.name in self._setters:
                    try:
                        self._setters[statement.name](arguments)
                    except (re.error, ValueError, OSError) as error:
                        raise BuildError(str(file), statement.line, f"{statement.name}(): {error}") from error
                yield Command(statement.name, tuple(arguments), statement.line, file, self._folder)

    def _arguments(self, words: Sequence[Word]) -> list[str]:
        """Expand the variables in words. A list in an unquoted word becomes several words."""
        found: list[str] = []
        for word in words:
            text = self._filled(word.text)
            found += [text] if word.quoted else _items(text)
        return found

    def _filled(self, text: str) -> str:
        """Expand variables, starting with the innermost, as in ``${${NAME}_SOURCE_DIR}``."""

        def value(match: re.Match[str]) -> str:
            name = f"ENV{{{match[2]}}}" if match[1] else match[2]
            return _escaped(self._known.get(name, ""))

        count = 1
        while count:
            text, count = _VARIABLE.subn(value, text)
        return re.sub(r"\\(.)", r"\1", text, flags=re.DOTALL)

    # --- control flow

    def _if(self, statement: Statement, arguments: list[str], file: Path) -> Iterator[Command]:
        holds = self._holds(statement, file)
        taken = False
        for each in statement.body:
            if each.name in ("else", "elseif"):
                taken = taken or holds
                holds = not taken and (each.name == "else" or self._holds(each, file))
            elif holds:
                yield from self._run([each], file)

    def _holds(self, statement: Statement, file: Path) -> bool:
        words = [Word(text, word.quoted) for word in statement.words for text in self._arguments([word])]
        try:
            return _Condition(words, self._known, self._folder).value()
        except (ValueError, re.error) as error:
            raise BuildError(str(file), statement.line, f"{statement.name}(): {error}") from error

    def _foreach(self, statement: Statement, arguments: list[str], file: Path) -> Iterator[Command]:
        try:
            items = self._loop_items(arguments[1:])
        except ValueError as error:
            raise BuildError(str(file), statement.line, f"foreach(): {error}") from error
        for item in items:
            self._known[arguments[0]] = item
            try:
                yield from self._run(statement.body, file)
            except _Leave as leave:
                if str(leave) == "return":
                    raise
                if str(leave) == "break":
                    break

    def _loop_items(self, words: list[str]) -> list[str]:
        """Return the items of a loop: the words, the numbers of a ``RANGE``, or for ``IN``, the ``LISTS`` and ``ITEMS``.

        Raise ValueError if a ``RANGE`` has more than ``_MAX_LOOPS`` numbers.
        """
        if words[:1] == ["RANGE"]:
            numbers = [int(word) for word in words[1:] if word.isdecimal() and len(word) < 20]
            start, stop, step = (0, *numbers, 1) if len(numbers) == 1 else (*numbers, 1, 1, 1)[:3]
            step = step or 1
            if (count := (stop - start) // step + 1) > _MAX_LOOPS:
                raise ValueError(f"RANGE has {count} numbers, at most {_MAX_LOOPS} are read")
            return [str(number) for number in range(start, stop + 1, step)]
        if words[:1] != ["IN"]:
            return words
        given = keyword_arguments(tuple(words[1:]), frozenset(["LISTS", "ITEMS", "ZIP_LISTS"]))
        lists = [item for name in given.get("LISTS", []) for item in _items(self._known.get(name, ""))]
        return [*lists, *given.get("ITEMS", [])]

    def _leave(self, statement: Statement, arguments: list[str], file: Path) -> Iterator[Command]:
        raise _Leave(statement.name)

    def _define(self, statement: Statement, arguments: list[str], file: Path) -> Iterator[Command]:
        if arguments and arguments[0].lower() not in self._own:
            has_scope = statement.name == "function"
            self._macros[arguments[0].lower()] = _Macro(has_scope, arguments[1:], statement.body, file)
        yield from ()

    def _call(self, name: str, arguments: list[str]) -> Iterator[Command]:
        """Yield the commands that a function or macro runs.

        A function gets a new scope; a macro's arguments are substituted as text.
        """
        macro = self._macros[name]
        values = {
            **dict(zip(macro.parameters, arguments, strict=False)),
            **{f"ARGV{number}": value for number, value in enumerate(arguments)},
            "ARGV": ";".join(arguments),
            "ARGN": ";".join(arguments[len(macro.parameters) :]),
            "ARGC": str(len(arguments)),
        }
        if not macro.has_scope:
            # The commands of a macro run as part of the caller, so return() leaves the caller.
            with self._nested(macro.body, macro.file):
                yield from self._run(_substituted(macro.body, values), macro.file)
            return

        around, raised = self._known, self._raised
        self._known, self._raised = {**around, **values}, {}
        yield from self._body(macro.body, macro.file)
        self._known, self._raised = {**around, **self._raised}, raised

    def _include(self, statement: Statement, arguments: list[str], file: Path) -> Iterator[Command]:
        """Yield the commands of an included file in the package. Skip modules of CMake itself."""
        for name in arguments[:1]:
            folders = [self._folder, *self._module_folders()]
            paths = [folder / f"{name}{ending}" for folder in folders for ending in ("", ".cmake")]
            yield from self._first(paths, file)

    def _module_folders(self) -> list[Path]:
        return [self._folder / item for item in _items(self._known.get("CMAKE_MODULE_PATH", ""))]

    def _first(self, paths: Iterable[Path], file: Path) -> Iterator[Command]:
        """Yield the commands of the first file that exists, if any."""
        for path in filter(Path.is_file, paths):
            self._known["CMAKE_CURRENT_LIST_DIR"] = path.parent.as_posix()
            yield from self.file(path)
            self._known["CMAKE_CURRENT_LIST_DIR"] = file.parent.as_posix()
            break

    def _find(self, statement: Statement, arguments: list[str], file: Path) -> Iterator[Command]:
        """Yield find_package() itself, then the commands in the package's ``FindNAME.cmake``, if there is one."""
        self._find_package(arguments)
        yield Command(statement.name, tuple(arguments), statement.line, file, self._folder)
        for name in arguments[:1]:
            yield from self._first([folder / f"Find{name}.cmake" for folder in self._module_folders()], file)

    def _subdirectory(self, statement: Statement, arguments: list[str], file: Path) -> Iterator[Command]:
        for name in arguments[:1]:
            folder = self._folder / name
            if not (folder / "CMakeLists.txt").is_file():
                raise BuildError(
                    str(file),
                    statement.line,
                    f"add_subdirectory({name}): {folder / 'CMakeLists.txt'} does not exist",
                )
            places = dict.fromkeys(("CMAKE_CURRENT_SOURCE_DIR", "CMAKE_CURRENT_LIST_DIR"), folder.as_posix())
            below = _Run(folder, {**self._known, **places}, self._macros, self._depth, self._own)
            yield from below.file(folder / "CMakeLists.txt")
            self._known.update(below._raised)

    # --- variable assignment

    def _project(self, arguments: list[str]) -> None:
        for name in arguments[:1]:
            place = self._folder.as_posix()
            self._known.update(
                {"PROJECT_NAME": name, "PROJECT_SOURCE_DIR": place, f"{name}_SOURCE_DIR": place}
            )
            if "CMAKE_PROJECT_NAME" not in self._known:
                self._known["CMAKE_PROJECT_NAME"] = name

    def _set(self, arguments: list[str]) -> None:
        name, values = (*arguments[:1], "")[0], arguments[1:]
        if "CACHE" in values and name in self._known and "FORCE" not in values:
            return
        scope = self._raised if values[-1:] == ["PARENT_SCOPE"] else self._known
        ends = [values.index(word) for word in ("CACHE", "PARENT_SCOPE") if word in values]
        scope[name] = ";".join(values[: min(ends, default=len(values))])

    def _unset(self, arguments: list[str]) -> None:
        for name in arguments[:1]:
            self._known.pop(name, None)

    def _option(self, arguments: list[str]) -> None:
        for name in arguments[:1]:
            self._known.setdefault(name, (*arguments[2:], "OFF")[0])

    def _list(self, arguments: list[str]) -> None:
        verb, name, *words = (*arguments, "", "")[: max(2, len(arguments))]
        items = _items(self._known.get(name, ""))
        change = _LIST_VERBS.get(verb)
        if verb == "LENGTH" and words:
            self._known[words[0]] = str(len(items))
        elif change:
            self._known[name] = ";".join(change(items, words))

    def _string(self, arguments: list[str]) -> None:
        verb, *words = (*arguments, "")[: max(1, len(arguments))]
        if verb in ("TOLOWER", "TOUPPER") and len(words) == 2:
            self._known[words[1]] = words[0].lower() if verb == "TOLOWER" else words[0].upper()
        elif verb == "REPLACE" and len(words) > 3:
            self._known[words[2]] = "".join(words[3:]).replace(words[0], words[1])
        elif verb == "REGEX" and words[:1] == ["REPLACE"] and len(words) > 4:
            self._known[words[3]] = re.sub(words[1], words[2], "".join(words[4:]))
        elif verb == "CONCAT" and words:
            self._known[words[0]] = "".join(words[1:])
        elif verb == "APPEND" and words:
            self._known[words[0]] = self._known.get(words[0], "") + "".join(words[1:])

    def _file(self, arguments: list[str]) -> None:
        """Run ``file(GLOB NAME pattern ...)`` or ``GLOB_RECURSE``."""
        if len(arguments) < 2 or arguments[0] not in ("GLOB", "GLOB_RECURSE"):
            return

        words = [word for word in arguments[2:] if word != "CONFIGURE_DEPENDS"]
        base = None
        for flag in ("LIST_DIRECTORIES", "RELATIVE"):
            if flag in words:
                index = words.index(flag)
                base = self._folder / "".join(words[index + 1 : index + 2]) if flag == "RELATIVE" else base
                del words[index : index + 2]

        found: list[Path] = []
        for pattern in words:
            path = self._folder / pattern
            # Match below the package's folder, because the path of the folder may contain special characters of patterns.
            top = self._folder if path.is_relative_to(self._folder) else Path(path.anchor)
            *folders, last = path.relative_to(top).parts or ("*",)
            if arguments[0] == "GLOB":
                found += top.glob("/".join([*folders, last]))
            elif top == self._folder:
                # Search only within the package: with an unset variable, `${UNSET}/*` would search the whole disk.
                found += filter(Path.is_file, top.glob("/".join([*folders, "**", last])))

        names = [path.relative_to(base) if base and path.is_relative_to(base) else path for path in found]
        self._known[arguments[1]] = ";".join(sorted(name.as_posix() for name in names))

    def _find_package(self, arguments: list[str]) -> None:
        """Report packages as found, because the build itself reports those that are missing.

        Optional packages (QUIET) and those of ROS 2 are not found.
        If a library is reported as missing, a file often ends with return(), before the commands that matter to Python.
        """
        name = "".join(arguments[:1])
        if "REQUIRED" in arguments or name in _HERE:
            self._known.update(dict.fromkeys((f"{name}_FOUND" for name in arguments), "1"))
        elif "QUIET" not in arguments and not _ROS_2.match(name):
            self._known.update(dict.fromkeys((f"{name}_FOUND", f"{name.upper()}_FOUND"), "1"))

    def _handle_standard_args(self, arguments: list[str]) -> None:
        """Report a library, sought by ``FindNAME.cmake`` or pkg-config, as found, because nothing is compiled with it."""
        for name in arguments[:1]:
            self._known.update(dict.fromkeys((f"{name}_FOUND", f"{name.upper()}_FOUND"), "TRUE"))

    def _check(self, arguments: list[str]) -> None:
        """Run ``check_include_files(header NAME)``. Report the header as found, because nothing is compiled with it."""
        for name in arguments[1:2]:
            self._known[name] = "1"

    def _filename(self, arguments: list[str]) -> None:
        """Run ``get_filename_component(NAME file what)``."""
        if len(arguments) > 2:
            path = self._folder / arguments[1]
            parts = {
                "NAME": path.name,
                "NAME_WE": path.name.split(".")[0],
                "EXT": "".join(path.suffixes),
                **dict.fromkeys(("DIRECTORY", "PATH"), Path(arguments[1]).parent.as_posix()),
                **dict.fromkeys(("ABSOLUTE", "REALPATH"), path.resolve().as_posix()),
            }
            self._known[arguments[0]] = parts.get(arguments[2], "")


def _filtered(items: list[str], words: list[str]) -> list[str]:
    """Run ``list(FILTER items INCLUDE|EXCLUDE REGEX pattern)``."""
    keep = words[:1] == ["INCLUDE"]
    return [item for item in items if bool(re.search(words[-1], item)) is keep] if words else items


_LIST_VERBS: dict[str, Callable[[list[str], list[str]], list[str]]] = {
    "APPEND": operator.add,
    "PREPEND": lambda items, words: words + items,
    "REMOVE_ITEM": lambda items, words: [item for item in items if item not in words],
    "REMOVE_DUPLICATES": lambda items, words: list(dict.fromkeys(items)),
    "SORT": lambda items, words: sorted(items),
    "REVERSE": lambda items, words: items[::-1],
    "FILTER": _filtered,
}


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _version(text: str) -> list[int]:
    numbers = [int(part) for part in re.findall(r"\d+", text)]
    while numbers and not numbers[-1]:
        numbers.pop()
    return numbers


_COMPARE: dict[str, Callable[[str, str], bool]] = {
    "MATCHES": lambda left, right: bool(re.search(right, left)),
    # Generated files do not exist yet. As in CMake, return true for them, so that they are generated.
    "IS_NEWER_THAN": lambda left, right: True,
    **{
        prefix + name: lambda left, right, read=read, test=test: test(read(left), read(right))  # type: ignore[misc]
        for prefix, read in (("", _number), ("STR", str), ("VERSION_", _version))
        for name, test in (
            ("EQUAL", operator.eq),
            ("LESS", operator.lt),
            ("GREATER", operator.gt),
            ("LESS_EQUAL", operator.le),
            ("GREATER_EQUAL", operator.ge),
        )
    },
}


_OPERATORS = {Word(text) for text in (*_COMPARE, "IN_LIST", "AND", "OR", ")")}


class _Condition:
    """Parses and evaluates the condition of an if() or while().

    The grammar is ``any := one {AND one | OR one}``, ``one := NOT one | ( any ) | TEST word | word [COMPARE word]``.
    """

    def __init__(self, words: Sequence[Word], known: Mapping[str, str], folder: Path) -> None:
        self._words = words
        self._next = 0
        self._known = known
        self._tests: dict[str, Callable[[str], bool]] = {
            "DEFINED": lambda name: name in known,
            "EXISTS": lambda name: bool(name) and (folder / name).exists(),
            "IS_DIRECTORY": lambda name: bool(name) and (folder / name).is_dir(),
            "IS_SYMLINK": lambda name: bool(name) and (folder / name).is_symlink(),
            "IS_ABSOLUTE": lambda name: Path(name).is_absolute(),
            # Of the targets, only those for generated code exist. Commands and policies in a test are CMake's own, so they exist.
            "TARGET": lambda name: bool(re.search(r"_gen(erate_messages|cfg|cpp|py)", name)),
            "COMMAND": lambda name: True,
            "POLICY": lambda name: True,
        }

    def value(self) -> bool:
        result = self._any()
        if self._next < len(self._words):
            raise ValueError(f"AND or OR is expected instead of [{self._words[self._next].text}]")
        return result

    def _any(self) -> bool:
        # CMake evaluates AND and OR from left to right, without precedence.
        result = self._one()
        while self._next < len(self._words):
            if self._took("AND"):
                result = self._one() and result
            elif self._took("OR"):
                result = self._one() or result
            else:
                break
        return result

    def _one(self) -> bool:
        if self._took("NOT"):
            return not self._one()

        if self._took("("):
            result = self._any()
            if not self._took(")"):
                raise ValueError("a bracket is not closed")
            return result

        for name, test in self._tests.items():
            if self._next + 1 < len(self._words) and self._took(name):
                return test(self._word().text)

        left = self._word()
        for name, compare in _COMPARE.items():
            if self._took(name):
                return compare(self._value(left), self._value(self._word()))

        if self._took("IN_LIST"):
            return self._value(left) in _items(self._known.get(self._word().text, ""))

        if _TRUE.match(left.text) or _FALSE.match(left.text):
            # A constant has its own value, even if there is a variable of the same name.
            return bool(_TRUE.match(left.text))
        return not left.quoted and not _FALSE.match(self._known.get(left.text, ""))

    def _value(self, word: Word) -> str:
        """Return the value of the variable that an unquoted word names, otherwise the word itself."""
        return word.text if word.quoted else self._known.get(word.text, word.text)

    def _word(self) -> Word:
        # An empty variable expands to nothing, not even an empty word: `if(${UNSET} STREQUAL "x")`.
        if self._next >= len(self._words) or self._words[self._next] in _OPERATORS:
            return Word("", True)
        self._next += 1
        return self._words[self._next - 1]

    def _took(self, text: str) -> bool:
        if self._next >= len(self._words) or self._words[self._next] != Word(text):
            return False
        self._next += 1
        return True
