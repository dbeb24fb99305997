"""Parse a package.xml of format 1, 2 or 3, or rosbuild's manifest.xml, into a frozen :class:`Manifest`.

Parsing is lenient: errors that catkin reports but a reader can ignore (a missing maintainer, a tag of another format) are
recorded in :attr:`Manifest.problems`, and a build prints them as warnings.

Source: http://wiki.ros.org/catkin/package.xml, https://ros.org/reps/rep-0127.html (format 1),
https://ros.org/reps/rep-0140.html (format 2), https://ros.org/reps/rep-0149.html (format 3, conditions).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from enum import Enum
from pathlib import Path
from typing import NamedTuple
from xml.parsers import expat

from minirospy.base.errors import ManifestError
from minirospy.base.xml_text import MAX_LEVELS, XmlError, new_parser
from minirospy.workspace.packages import ROSBUILD_MANIFEST

__all__ = [
    "EMAIL",
    "PACKAGE_NAME",
    "VARIABLES",
    "Dependency",
    "Export",
    "Kind",
    "Manifest",
    "ManifestError",
    "Person",
    "Url",
    "evaluate_condition",
    "naming_warning",
    "parse_manifest",
    "read_manifest",
]

VARIABLES: Mapping[str, str] = {"ROS_VERSION": "1", "ROS_DISTRO": "noetic", "ROS_PYTHON_VERSION": "3"}
"""Default values of the variables in conditions."""

_CONVENTIONAL_NAME = re.compile(r"^[a-z][a-z0-9_-]*$")
PACKAGE_NAME = re.compile(r"^[a-zA-Z0-9][a-zA-Z0-9_.-]*$")


class Kind(Enum):
    """The purpose of a dependency. The value is the tag in formats 2 and 3."""

    BUILD = "build_depend"
    BUILD_EXPORT = "build_export_depend"
    BUILDTOOL = "buildtool_depend"
    BUILDTOOL_EXPORT = "buildtool_export_depend"
    EXEC = "exec_depend"
    TEST = "test_depend"
    DOC = "doc_depend"


class Dependency(NamedTuple):
    """A dependency on a package or rosdep key. ``tag`` is the tag used in the file (``run_depend``), ``line`` its line."""

    name: str
    kinds: frozenset[Kind]
    tag: str
    line: int


class Person(NamedTuple):
    """A maintainer or author."""

    name: str
    email: str


class Url(NamedTuple):
    """A URL of the package. ``type`` is website, bugtracker or repository."""

    url: str
    type: str


class Export(NamedTuple):
    """A tag within ``<export>``, intended for other tools."""

    tag: str
    attributes: Mapping[str, str]
    text: str
    line: int


class Problem(NamedTuple):
    """An error that catkin would report, with its line."""

    line: int
    text: str


class Manifest(NamedTuple):
    """A package.xml or, with ``format`` 0, a manifest.xml for rosbuild.

    Conditions have been evaluated: elements whose condition is false are left out.

    ``dependencies`` are in file order; :meth:`depends` selects their names by kind.
    """

    path: Path
    format: int
    name: str
    version: str
    description: str
    maintainers: tuple[Person, ...]
    licenses: tuple[str, ...]
    authors: tuple[Person, ...]
    urls: tuple[Url, ...]
    dependencies: tuple[Dependency, ...]
    exports: tuple[Export, ...]
    problems: tuple[Problem, ...]

    def depends(self, *kinds: Kind) -> tuple[str, ...]:
        """Return the names of all dependencies, or those of the given kinds, in file order without duplicates."""
        wanted = frozenset(kinds or Kind)
        return tuple(dict.fromkeys(each.name for each in self.dependencies if wanted & each.kinds))

    @property
    def is_rosbuild(self) -> bool:
        """Return whether this is a manifest.xml."""
        return self.path.name == ROSBUILD_MANIFEST

    @property
    def is_metapackage(self) -> bool:
        return any(export.tag == "metapackage" for export in self.exports)

    @property
    def build_type(self) -> str:
        """Return the name of the package's build tool (default: catkin)."""
        return next((export.text for export in self.exports if export.tag == "build_type"), "") or "catkin"


def naming_warning(name: str) -> str | None:
    """Return catkin's warning about a package name that violates the conventions (REP 144), otherwise None."""
    if _CONVENTIONAL_NAME.match(name):
        return None
    return (
        f'Package name "{name}" does not follow the naming conventions. It should start with a lower case letter and '
        "only contain lower case letters, digits, underscores, and dashes."
    )


def read_manifest(path: Path, variables: Mapping[str, str] | None = None) -> Manifest:
    """Read a manifest: a file, or the package.xml in a folder. ``variables`` override VARIABLES in conditions.

    A folder without a package.xml may have a manifest.xml, for rosbuild.

    Raise ManifestError if the file does not exist, is not a package's XML, has no name, or contains an invalid condition.
    """
    if path.is_dir():
        folder, path = path, path / "package.xml"
        if not path.exists() and (folder / ROSBUILD_MANIFEST).is_file():
            path = folder / ROSBUILD_MANIFEST
    try:
        text = path.read_bytes()
    except OSError as error:
        raise ManifestError(str(path), 0, error.strerror or str(error)) from error
    return parse_manifest(text, path, variables)


def parse_manifest(text: bytes | str, path: Path, variables: Mapping[str, str] | None = None) -> Manifest:
    """Parse a manifest. ``path`` is for error messages. Raise the same exceptions as :func:`read_manifest`."""
    root = _parse(text, path)
    if root.tag != "package":
        raise ManifestError(str(path), root.line, f"the root tag is <{root.tag}> instead of <package>")
    if path.name == ROSBUILD_MANIFEST:
        return _rosbuild_manifest(root, path)
    return _Reader(root, path, {**VARIABLES, **(variables or {})}).manifest()


def evaluate_condition(condition: str, variables: Mapping[str, str]) -> bool:
    """Return whether a condition such as ``$ROS_VERSION == 1 and ...`` is true.

    Values are compared as strings, and an unknown variable is empty. Raise ValueError, with the reason, if the condition
    cannot be parsed.
    """
    return _Condition(condition, variables).value()


# --- XML


class _Element:
    """A tag: its line, its children, and all text within it, including that of the children."""

    __slots__ = ("attributes", "children", "line", "parts", "tag")

    def __init__(self, tag: str, attributes: dict[str, str], line: int) -> None:
        self.tag = tag
        self.attributes = attributes
        self.line = line
        self.children: list[_Element] = []
        self.parts: list[str] = []

    @property
    def text(self) -> str:
        """Return the text. Any sequence of white space is replaced by a single space."""
        return " ".join("".join(self.parts).split())


def _parse(text: bytes | str, path: Path) -> _Element:
    top = _Element("", {}, 0)
    stack = [top]
    parser = new_parser()

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(stack) > MAX_LEVELS:
            raise XmlError(parser.CurrentLineNumber, f"tags are nested deeper than {MAX_LEVELS} levels")
        element = _Element(tag, attributes, parser.CurrentLineNumber)
        stack[-1].children.append(element)
        stack.append(element)

    def end(tag: str) -> None:
        element = stack.pop()
        stack[-1].parts += element.parts

    def data(text: str) -> None:
        stack[-1].parts.append(text)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = data
    try:
        parser.Parse(text, True)
    except XmlError as error:
        raise ManifestError(str(path), error.line, error.why) from error
    except (expat.ExpatError, ValueError, LookupError) as error:
        # For an encoding that Python does not know, the error is a LookupError, which has no code.
        code = getattr(error, "code", None)
        why = expat.ErrorString(code) if code is not None else str(error)
        raise ManifestError(str(path), parser.CurrentLineNumber, f"not XML: {why}") from error
    return top.children[0]


def _rosbuild_manifest(root: _Element, path: Path) -> Manifest:
    """Convert the root tag of a manifest.xml. Source: http://wiki.ros.org/Manifest."""
    dependencies = []
    for element in root.children:
        attribute = {"depend": "package", "rosdep": "name"}.get(element.tag)
        if attribute is None or "thirdparty" in element.attributes:
            continue
        if not element.attributes.get(attribute):
            raise ManifestError(
                str(path), element.line, f"<{element.tag}> is missing the attribute '{attribute}'"
            )
        kinds = _KINDS["depend"] if element.tag == "depend" else {Kind.BUILD}
        name = element.attributes[attribute]
        dependencies.append(Dependency(name, frozenset(kinds), element.tag, element.line))

    def texts(tag: str) -> tuple[str, ...]:
        return tuple(element.text for element in root.children if element.tag == tag)

    return Manifest(
        path=path,
        format=0,
        name=path.parent.name,
        version=", ".join(texts("version")),
        description=", ".join(texts("description")),
        maintainers=(),
        licenses=texts("license"),
        authors=tuple(Person(text, "") for text in texts("author")),
        urls=tuple(Url(text, "website") for text in texts("url")),
        dependencies=tuple(dependencies),
        exports=tuple(
            Export(child.tag, child.attributes, child.text, child.line)
            for element in root.children
            if element.tag == "export"
            for child in element.children
        ),
        problems=(),
    )


# --- tags

_OLD_KINDS = {
    "build_depend": {Kind.BUILD},
    "buildtool_depend": {Kind.BUILDTOOL},
    "run_depend": {Kind.BUILD_EXPORT, Kind.EXEC},
    "test_depend": {Kind.TEST},
}
_KINDS = {
    "depend": {Kind.BUILD, Kind.BUILD_EXPORT, Kind.EXEC},
    # Packages in formats 2 and 3 use this tag, too, although these formats do not define it.
    "run_depend": {Kind.BUILD_EXPORT, Kind.EXEC},
    **{kind.value: {kind} for kind in Kind},
}
_ALL_KINDS = {**_KINDS, **_OLD_KINDS}
_SINGLE = ("name", "version", "description")
_TEXTS = {*_SINGLE, "maintainer", "license", "author", "url", "export", "conflict", "replace"}
_TAGS = {
    1: {*_TEXTS, *_OLD_KINDS},
    2: {*_TEXTS, *_KINDS} - {"run_depend"},
    3: {*_TEXTS, *_KINDS, "group_depend", "member_of_group"} - {"run_depend"},
}
_REPLACED = {
    (
        1,
        "depend",
    ): "format 1 has <build_depend> and <run_depend>; with <package format='2'> <depend> is right",
    (1, "exec_depend"): "format 1 calls it <run_depend>",
    (2, "run_depend"): "formats 2 and 3 call it <exec_depend>, or <depend> with <build_depend>",
    (3, "run_depend"): "formats 2 and 3 call it <exec_depend>, or <depend> with <build_depend>",
}
_VERSIONS = {"version_lt", "version_lte", "version_eq", "version_gte", "version_gt"}
_CONDITIONAL = {*_ALL_KINDS, "conflict", "replace", "group_depend", "member_of_group"}
_VERSION = re.compile(r"^\d+\.\d+\.\d+$")
EMAIL = re.compile(r"[-\w%+]+(\.[-\w%+]+)*@[-a-z\d%]+(\.[-a-z\d%]+)*\.[a-z]{2,}", re.ASCII | re.IGNORECASE)
"""E-mail addresses that catkin accepts; catkin exits with an error for other addresses."""


class _Reader:
    """Converts the children of <package>, tag by tag, to the fields of a Manifest."""

    def __init__(self, root: _Element, path: Path, variables: Mapping[str, str]) -> None:
        self._path = path
        self._variables = variables
        self._problems: list[Problem] = []
        self._root = root
        self._format = self._read_format()
        self._by_tag: dict[str, list[_Element]] = {}
        for element in root.children:
            self._check_tag(element)
            if element.tag not in _CONDITIONAL or self._holds(element):
                self._by_tag.setdefault(element.tag, []).append(element)

    def manifest(self) -> Manifest:
        name, version, description = (self._single(tag) for tag in _SINGLE)
        if not name:
            raise ManifestError(str(self._path), self._root.line, "the package has no <name>")
        self._check_texts(name, version)
        return Manifest(
            path=self._path,
            format=self._format,
            name=name,
            version=version,
            description=description,
            maintainers=self._persons("maintainer"),
            licenses=self._texts("license"),
            authors=self._persons("author"),
            urls=tuple(Url(e.text, e.attributes.get("type", "website")) for e in self._elements("url")),
            dependencies=self._dependencies(),
            exports=tuple(self._exports()),
            problems=tuple(sorted(self._problems)),
        )

    def _read_format(self) -> int:
        text = self._root.attributes.get("format", "1").strip()
        if text not in ("1", "2", "3"):
            self._problem(self._root, f"package format '{text}' is unknown: there are 1, 2 and 3")
            return 3
        return int(text)

    def _check_tag(self, element: _Element) -> None:
        tag = element.tag
        if tag not in _TAGS[self._format]:
            hint = _REPLACED.get((self._format, tag), "")
            self._problem(
                element, f"format {self._format} has no tag <{tag}>" + (f": {hint}" if hint else "")
            )
        elif tag in _ALL_KINDS:
            allowed = _VERSIONS | {"condition"} if self._format == 3 else _VERSIONS
            for name in sorted(set(element.attributes) - allowed):
                hint = ": conditions need <package format='3'>" if name == "condition" else ""
                self._problem(element, f"<{tag}> has no attribute '{name}'{hint}")

    def _holds(self, element: _Element) -> bool:
        condition = element.attributes.get("condition")
        if condition is None:
            return True
        try:
            return evaluate_condition(condition, self._variables)
        except ValueError as error:
            raise ManifestError(
                str(self._path), element.line, f"condition '{condition}' of <{element.tag}>: {error}"
            ) from error

    def _check_texts(self, name: str, version: str) -> None:
        if not PACKAGE_NAME.match(name):
            self._problem(self._element("name"), f"'{name}' is not a package name: letters, digits, '_'")
        if version and not _VERSION.match(version):
            self._problem(self._element("version"), f"version '{version}' is not of the form 1.2.3")
        for tag in ("maintainer", "license"):
            if tag not in self._by_tag:
                self._problem(self._root, f"the package has no <{tag}>")
        for element in self._elements("maintainer"):
            if not element.attributes.get("email"):
                self._problem(element, f"maintainer '{element.text}' has no email")
        for element in self._elements("maintainer") + self._elements("author"):
            email = element.attributes.get("email")
            if email and not EMAIL.fullmatch(email):
                self._problem(
                    element, f'Invalid email "{email}" for person "{element.text}" (ROS refuses the package)'
                )

    def _single(self, tag: str) -> str:
        found = self._elements(tag)
        if not found:
            self._problem(self._root, f"the package has no <{tag}>")
            return ""
        if len(found) > 1:
            self._problem(found[1], f"a second <{tag}>: the first is in line {found[0].line}")
        return found[0].text

    def _elements(self, tag: str) -> list[_Element]:
        return self._by_tag.get(tag, [])

    def _element(self, tag: str) -> _Element:
        return self._by_tag[tag][0]

    def _texts(self, tag: str) -> tuple[str, ...]:
        return tuple(element.text for element in self._elements(tag))

    def _persons(self, tag: str) -> tuple[Person, ...]:
        return tuple(Person(e.text, e.attributes.get("email", "")) for e in self._elements(tag))

    def _dependencies(self) -> tuple[Dependency, ...]:
        kinds = _OLD_KINDS if self._format == 1 else _KINDS
        found = [
            Dependency(element.text, frozenset(kinds.get(tag) or _ALL_KINDS[tag]), tag, element.line)
            for tag in _ALL_KINDS
            for element in self._elements(tag)
        ]
        return tuple(sorted(found, key=lambda each: each.line))

    def _exports(self) -> Iterable[Export]:
        for element in self._elements("export"):
            for child in element.children:
                if self._holds(child):
                    yield Export(child.tag, child.attributes, child.text, child.line)

    def _problem(self, element: _Element, text: str) -> None:
        self._problems.append(Problem(element.line, text))


# --- conditions

_TOKEN = re.compile(r"""\s*(?:(==|!=|<=|>=|<|>|[()])|(\$?[A-Za-z0-9_-]+)|("[^"]*"|'[^']*')|(\S))""", re.ASCII)
# maximum nesting of brackets in a condition; the parser recurses three times per level
_MAX_BRACKETS = 50
_COMPARE = {
    "==": str.__eq__,
    "!=": str.__ne__,
    "<": str.__lt__,
    "<=": str.__le__,
    ">": str.__gt__,
    ">=": str.__ge__,
}


class _Condition:
    """Parses and evaluates the condition of a dependency.

    The grammar is ``any := all {"or" all}``, ``all := one {"and" one}``, ``one := "(" any ")" | value operator value``.
    """

    def __init__(self, text: str, variables: Mapping[str, str]) -> None:
        self._variables = variables
        self._tokens = list(_TOKEN.finditer(text.rstrip()))
        self._next = 0
        self._open = 0

    def value(self) -> bool:
        result = self._any()
        if self._next < len(self._tokens):
            raise ValueError(f"'and' or 'or' is expected instead of '{self._peek()}'")
        return result

    def _any(self) -> bool:
        result = self._all()
        while self._took("or"):
            result = self._all() or result
        return result

    def _all(self) -> bool:
        result = self._one()
        while self._took("and"):
            result = self._one() and result
        return result

    def _one(self) -> bool:
        if self._took("("):
            self._open += 1
            if self._open > _MAX_BRACKETS:
                raise ValueError(f"brackets are nested deeper than {_MAX_BRACKETS} levels")
            result = self._any()
            self._open -= 1
            if not self._took(")"):
                raise ValueError("')' is missing")
            return result
        left = self._operand()
        compare = _COMPARE.get(self._peek())
        if compare is None:
            raise ValueError(f"one of {' '.join(_COMPARE)} is expected" + self._instead())
        self._next += 1
        return compare(left, self._operand())

    def _operand(self) -> str:
        if self._next >= len(self._tokens) or not (self._match()[2] or self._match()[3]):
            raise ValueError("a $VARIABLE or a text is expected" + self._instead())
        word, quoted = self._match()[2], self._match()[3]
        self._next += 1
        if quoted:
            return quoted[1:-1]
        return self._variables.get(word[1:], "") if word.startswith("$") else word

    def _took(self, token: str) -> bool:
        if self._peek() != token:
            return False
        self._next += 1
        return True

    def _peek(self) -> str:
        return self._match()[0].strip() if self._next < len(self._tokens) else ""

    def _match(self) -> re.Match[str]:
        return self._tokens[self._next]

    def _instead(self) -> str:
        return f" instead of '{self._peek()}'" if self._peek() else " at the end"
