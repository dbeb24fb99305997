"""catkin_pkg.package: a package.xml as an object. Source: https://ros.org/reps/rep-0127.html, rep-0140.html, rep-0149.html."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element, TreeBuilder, tostring
from xml.parsers.expat import ExpatError
from xml.sax.saxutils import escape

from minirospy.base.xml_text import XmlError, new_parser
from minirospy.ros.catkin_pkg.catkin_pkg.condition import evaluate_condition as evaluate_condition
from minirospy.workspace.manifest import EMAIL, naming_warning

__all__ = [
    "PACKAGE_MANIFEST_FILENAME",
    "PACKAGE_MANIFEST_SCHEMA_URLS",
    "Dependency",
    "Export",
    "GroupDependency",
    "GroupMembership",
    "InvalidPackage",
    "License",
    "Package",
    "Person",
    "Url",
    "has_ros_schema_reference",
    "has_ros_schema_reference_string",
    "package_exists_at",
    "parse_package",
    "parse_package_string",
]

PACKAGE_MANIFEST_FILENAME = "package.xml"
PACKAGE_MANIFEST_SCHEMA_URLS = [
    f"http://download.ros.org/schema/package_format{number}.xsd" for number in (1, 2, 3)
]

_VERSIONS = ("version_lt", "version_lte", "version_eq", "version_gte", "version_gt")
_LISTS = (
    "maintainers",
    "licenses",
    "urls",
    "authors",
    "build_depends",
    "buildtool_depends",
    "build_export_depends",
    "buildtool_export_depends",
    "exec_depends",
    "test_depends",
    "doc_depends",
    "conflicts",
    "replaces",
    "group_depends",
    "member_of_groups",
    "exports",
)
_DEPENDENCIES = {
    "build_depend": "build_depends",
    "buildtool_depend": "buildtool_depends",
    "build_export_depend": "build_export_depends",
    "buildtool_export_depend": "buildtool_export_depends",
    "exec_depend": "exec_depends",
    "test_depend": "test_depends",
    "doc_depend": "doc_depends",
    "conflict": "conflicts",
    "replace": "replaces",
}
"""Maps each tag to the package's attribute that lists its dependencies."""
# attributes to which the tag <depend> adds a dependency
_GENERIC = ("build_depends", "build_export_depends", "exec_depends")
_SINGLE = ("name", "version", "description")
_COMMON = {*_SINGLE, "maintainer", "license", "author", "url", "export", "conflict", "replace"}
_ONLY_FORMAT_1 = {"build_depend", "buildtool_depend", "run_depend", "test_depend"}
_KNOWN = {
    1: {*_COMMON, *_ONLY_FORMAT_1},
    2: {*_COMMON, *_DEPENDENCIES, "depend"},
    3: {*_COMMON, *_DEPENDENCIES, "depend", "group_depend", "member_of_group"},
}
_NAME = re.compile(r"[a-zA-Z0-9][a-zA-Z0-9_-]*")
_VERSION = re.compile(r"[0-9]+\.[0-9]+\.[0-9]+")


class InvalidPackage(Exception):
    """Raised if the package.xml is invalid."""

    def __init__(self, msg: str, package_path: str | None = None) -> None:
        super().__init__(msg)
        self.msg = msg
        self.package_path = package_path

    def __str__(self) -> str:
        prefix = f"Error(s) in package '{self.package_path}':\n" if self.package_path else ""
        return prefix + self.msg


class _Conditional:
    """An element with a condition; ``evaluated_condition`` is None before evaluation."""

    condition: str | None
    evaluated_condition: bool | None

    def evaluate_condition(self, context: Mapping[str, str]) -> bool:
        """Evaluate the condition. Raise ValueError if the condition is invalid."""
        self.evaluated_condition = evaluate_condition(self.condition, context)
        return self.evaluated_condition


class Dependency(_Conditional):
    """A dependency and the versions it accepts."""

    __slots__ = ["condition", "evaluated_condition", "name", *_VERSIONS]

    def __init__(self, name: str, **kwargs: str | None) -> None:
        for each in (*_VERSIONS, "condition"):
            setattr(self, each, kwargs.pop(each, None))
        self.name = name
        self.evaluated_condition = None
        if kwargs:
            raise TypeError(f"Unknown properties: {', '.join(kwargs)}")

    def _key(self) -> tuple[object, ...]:
        return (self.name, *(getattr(self, each) for each in (*_VERSIONS, "condition")))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Dependency) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __str__(self) -> str:
        return self.name

    def __repr__(self) -> str:
        names = ("name", *_VERSIONS, "condition")
        given = [f"{each}={getattr(self, each)!r}" for each in names if getattr(self, each) is not None]
        return f"Dependency({', '.join(given)})"


class _Group(_Conditional):
    __slots__ = ["condition", "evaluated_condition", "name"]

    def __init__(self, name: str, condition: str | None = None) -> None:
        self.name = name
        self.condition = condition
        self.evaluated_condition = None

    def __str__(self) -> str:
        return self.name


class GroupDependency(_Group):
    """A dependency on all packages in a group."""


class GroupMembership(_Group):
    """A package's membership in a group."""


class Export(_Conditional):
    """A tag inside ``<export>``; ``content`` is the tag's inner XML."""

    __slots__ = ["attributes", "content", "evaluated_condition", "tagname"]

    def __init__(self, tagname: str, content: str | None = None) -> None:
        self.tagname = tagname
        self.attributes: dict[str, str] = {}
        self.content = content
        self.evaluated_condition = None

    @property
    def condition(self) -> str | None:  # type: ignore[override]
        """Return the value of the XML attribute ``condition``, or None if it is not set."""
        return self.attributes.get("condition")

    def __str__(self) -> str:
        attributes = "".join(f' {name}="{value}"' for name, value in self.attributes.items())
        end = f">{self.content}</{self.tagname}>" if self.content else "/>"
        return f"<{self.tagname}{attributes}{end}"


class License(str):
    """The name of a license; ``file`` is the name of the file that contains the license text, or None."""

    file: str | None = None


class Person:
    """A maintainer or author."""

    __slots__ = ["email", "name"]

    def __init__(self, name: str, email: str | None = None) -> None:
        self.name = name
        self.email = email

    def __str__(self) -> str:
        return self.name if self.email is None else f"{self.name} <{self.email}>"

    def validate(self) -> None:
        """Raise InvalidPackage if the email address is invalid."""
        if self.email is not None and not EMAIL.fullmatch(self.email):
            raise InvalidPackage(f'Invalid email "{self.email}" for person "{self.name}"')


class Url:
    """A URL of the package: a website, bugtracker or repository."""

    __slots__ = ["type", "url"]

    def __init__(self, url: str, type_: str | None = None) -> None:
        self.url = url
        self.type = type_

    def __str__(self) -> str:
        return self.url


class Package:
    """The contents of a package.xml. ``evaluate_conditions`` sets the dependencies' ``evaluated_condition``."""

    __slots__ = [
        "package_format",
        "name",
        "version",
        "version_compatibility",
        "description",
        "plaintext_description",
        *_LISTS,
        "filename",
    ]

    package_format: int | None
    name: str
    version: str
    version_compatibility: str | None
    description: str
    plaintext_description: str
    filename: str | None
    maintainers: list[Person]
    licenses: list[License]
    urls: list[Url]
    authors: list[Person]
    build_depends: list[Dependency]
    buildtool_depends: list[Dependency]
    build_export_depends: list[Dependency]
    buildtool_export_depends: list[Dependency]
    exec_depends: list[Dependency]
    test_depends: list[Dependency]
    doc_depends: list[Dependency]
    conflicts: list[Dependency]
    replaces: list[Dependency]
    group_depends: list[GroupDependency]
    member_of_groups: list[GroupMembership]
    exports: list[Export]

    def __init__(self, filename: str | None = None, **kwargs: object) -> None:
        for name in self.__slots__:
            value = kwargs.pop(name, [] if name in _LISTS else None)
            setattr(self, name, list(value) if name in _LISTS else value)  # type: ignore[call-overload]
        self.filename = filename
        if kwargs:
            raise TypeError(f"Unknown properties: {', '.join(kwargs)}")

    @property
    def run_depends(self) -> list[Dependency]:
        """Return the runtime dependencies, as defined in format 1."""
        others = (each for each in self.build_export_depends if each not in self.exec_depends)
        return [*self.exec_depends, *others]

    def __getattr__(self, name: str) -> object:
        raise AttributeError(name)

    def __getitem__(self, key: str) -> object:
        if key in (*self.__slots__, "run_depends"):
            return getattr(self, key)
        raise KeyError(f'Unknown key "{key}"')

    def __iter__(self) -> Iterator[str]:
        return iter(self.__slots__)

    def __str__(self) -> str:
        return str({name: getattr(self, name) for name in self.__slots__})

    def has_buildtool_depend_on_catkin(self) -> bool:
        """Return whether the package has a build tool dependency on catkin."""
        return "catkin" in (each.name for each in self.buildtool_depends)

    def get_build_type(self) -> str:
        """Return the build tool specified in ``<export>``, by default catkin. Raise InvalidPackage if several are specified."""
        kept = [each for each in self.exports if each.evaluated_condition is not False]
        types = [each.content or "" for each in kept if each.tagname == "build_type"]
        if len(types) > 1:
            raise InvalidPackage("Only one <build_type> element is permitted.", self.filename)
        return types[0] if types else "catkin"

    def get_unconditional_build_types(self) -> list[str]:
        """Return the build tools that ``<export>`` specifies unconditionally."""
        exports = (each for each in self.exports if each.tagname == "build_type" and each.condition is None)
        return [each.content or "" for each in exports]

    def is_metapackage(self) -> bool:
        """Return whether the package is a metapackage, which only lists other packages."""
        return "metapackage" in (each.tagname for each in self.exports)

    def has_invalid_metapackage_dependencies(self) -> bool:
        """Return whether the package has dependencies that a metapackage must not have."""
        tools = [each for each in self.buildtool_depends if each.name != "catkin"]
        return bool(self.build_depends or tools or self.test_depends)

    def evaluate_conditions(self, context: Mapping[str, str]) -> None:
        """Evaluate the conditions of all dependencies and exports. Raise ValueError if a condition is invalid."""
        groups = (*self.group_depends, *self.member_of_groups, *self.exports)
        names = _DEPENDENCIES.values()
        for each in (*groups, *(one for name in names for one in getattr(self, name))):
            each.evaluate_condition(context)

    def validate(self, warnings: list[str] | None = None) -> None:
        """Check the contents. Append warnings to the list ``warnings`` or, if ``warnings`` is None, print them.

        Raise InvalidPackage with all errors.
        """
        errors = self._errors()
        for warning in self._warnings():
            if warnings is None:
                print(f"WARNING: {warning}", file=sys.stderr)
            elif warning not in warnings:
                warnings.append(warning)
        if errors:
            raise InvalidPackage("\n".join(errors), self.filename)

    def _errors(self) -> list[str]:
        errors = []
        if self.package_format and not isinstance(self.package_format, int):
            errors.append(
                f'The "format" attribute of the package must be an integer if present, not "{self.package_format}"'
            )
        if not self.name:
            errors.append("Package name must not be empty")
        elif not _NAME.fullmatch(self.name):
            errors.append(f'Package name "{self.name}" does not follow naming conventions')
        if not self.version:
            errors.append("Package version must not be empty")
        elif not _VERSION.fullmatch(self.version):
            errors.append(f'Package version "{self.version}" does not follow version conventions')
        if not self.description:
            errors.append("Package description must not be empty")
        if not self.maintainers:
            errors.append(f"Package '{self.name}' must declare at least one maintainer")
        for person in (*self.maintainers, *self.authors):
            try:
                person.validate()
            except InvalidPackage as error:
                errors.append(error.msg)
        if not self.licenses:
            errors.append('The package node must contain at least one "license" tag')
        if any(not license_.strip() for license_ in self.licenses):
            errors.append("The license tag must neither be empty nor only contain whitespaces")
        for tag, name in _DEPENDENCIES.items():
            if tag not in ("conflict", "replace") and self.name in (d.name for d in getattr(self, name)):
                errors.append(
                    f'The package "{self.name}" must not "{tag}" on a package with the same name as this package'
                )
        return errors

    def _warnings(self) -> Iterator[str]:
        if self.name and _NAME.fullmatch(self.name) and (warning := naming_warning(self.name)):
            yield warning
        if self.is_metapackage():
            if not self.has_buildtool_depend_on_catkin():
                yield f'Metapackage "{self.name}" must buildtool_depend on catkin.'
            if self.has_invalid_metapackage_dependencies():
                kind = "run_depends" if self.package_format == 1 else "exec_depends"
                yield (
                    f'Metapackage "{self.name}" should not have other dependencies besides a buildtool_depend on '
                    f"catkin and {kind}."
                )


def package_exists_at(path: str) -> bool:
    """Return whether a folder contains a package.xml."""
    return os.path.isdir(path) and os.path.isfile(os.path.join(path, PACKAGE_MANIFEST_FILENAME))


def parse_package(path: str, warnings: list[str] | None = None) -> Package:
    """Parse a package.xml, given its path or its folder. Raise InvalidPackage if it is invalid, OSError if it cannot be read."""
    filename = _file_of(path)
    with open(filename, "rb") as file:
        return parse_package_string(file.read(), filename, warnings)


def has_ros_schema_reference(path: str) -> bool:
    """Return whether a package.xml, given its path or its folder, refers to ROS's schema.

    Raise OSError if there is no file.
    """
    with open(_file_of(path), "rb") as file:
        return has_ros_schema_reference_string(file.read())


def has_ros_schema_reference_string(data: str | bytes) -> bool:
    """Return whether a package.xml's text refers to ROS's schema in an `xml-model` instruction.

    Return False if the text is not XML.
    """
    hrefs: list[str] = []

    def found(target: str, text: str) -> None:
        href = re.search(r'href="([A-Za-z0-9._/:]*)"', text)
        if target == "xml-model" and href:
            hrefs.append(href[1])

    parser = new_parser()
    parser.ProcessingInstructionHandler = found
    try:
        parser.Parse(data, True)
    except (ExpatError, XmlError, ValueError, LookupError):
        return False
    return any(href in PACKAGE_MANIFEST_SCHEMA_URLS for href in hrefs)


def _file_of(path: str) -> str:
    if os.path.isfile(path):
        return path
    if package_exists_at(path):
        return os.path.join(path, PACKAGE_MANIFEST_FILENAME)
    raise OSError(
        f'Path "{path}" is neither a directory containing a "{PACKAGE_MANIFEST_FILENAME}" file nor a file'
    )


def parse_package_string(
    data: str | bytes, filename: str | None = None, warnings: list[str] | None = None
) -> Package:
    """Return the package described by a package.xml's text; ``filename`` is used in error messages.

    Raise InvalidPackage if the text is invalid.
    """
    root = _parsed(data, filename)
    if root.tag != "package":
        raise InvalidPackage('The manifest must contain a single "package" root tag', filename)
    package = Package(filename)
    text = root.get("format", "1")
    if text not in ("1", "2", "3"):
        raise InvalidPackage(
            f"Unable to handle package.xml format version '{text}', please update catkin_pkg (e.g. on Ubuntu/Debian "
            "use: sudo apt-get update && sudo apt-get install --only-upgrade python-catkin-pkg)",
            filename,
        )
    package.package_format = int(text)
    for tag in _SINGLE:
        if len(root.findall(tag)) != 1:
            raise InvalidPackage(f'The manifest must contain exactly one "{tag}" tag', filename)

    package.name = _text(root.findall("name")[0])
    version = root.findall("version")[0]
    package.version = _text(version)
    package.version_compatibility = version.get("compatibility")
    package.description = _inside(root.findall("description")[0])
    package.plaintext_description = " ".join("".join(root.findall("description")[0].itertext()).split())

    for tag, persons in (("maintainer", package.maintainers), ("author", package.authors)):
        for each in root.findall(tag):
            if tag == "maintainer" and each.get("email") is None:
                raise InvalidPackage('The "maintainer" tag must have the attribute "email"')
            persons.append(Person(_text(each), each.get("email")))
    for each in root.findall("license"):
        found = License(_text(each))
        found.file = each.get("file")
        package.licenses.append(found)
    package.urls += [Url(_text(each), each.get("type", "website")) for each in root.findall("url")]

    errors = _read_dependencies(package, root)
    for export in root.findall("export"):
        for each in export:
            one = Export(each.tag, _inside(each))
            one.attributes = dict(each.attrib)
            package.exports.append(one)

    errors += _unknown(package, root)
    if errors:
        raise InvalidPackage("Error(s):" + "".join(f"\n- {error}" for error in errors), filename)
    package.validate(warnings)
    return package


def _read_dependencies(package: Package, root: Element) -> list[str]:
    """Add the dependencies to a package; return the errors found in them."""
    for tag, name in _DEPENDENCIES.items():
        if tag in _KNOWN[package.package_format or 1]:
            getattr(package, name).extend(map(_dependency, root.findall(tag)))
    errors = []
    if package.package_format == 1:
        runs = [_dependency(each) for each in root.findall("run_depend")]
        package.build_export_depends += runs
        package.exec_depends += [_dependency(each) for each in root.findall("run_depend")]
        for test in package.test_depends:
            same = ["build_depend"] * (test in package.build_depends) + ["run_depend"] * (test in runs)
            if same:
                errors.append(f'The test dependency on "{test}" is redundant with: {", ".join(same)}')
    else:
        for each in map(_dependency, root.findall("depend")):
            same = [name.removesuffix("s") for name in _GENERIC if each in getattr(package, name)]
            if same:
                errors.append(f"The generic dependency on '{each}' is redundant with: {', '.join(same)}")
            for name in _GENERIC:
                getattr(package, name).append(each)
    if package.package_format == 3:
        for group in root.findall("group_depend"):
            package.group_depends.append(GroupDependency(_text(group), group.get("condition")))
        for group in root.findall("member_of_group"):
            package.member_of_groups.append(GroupMembership(_text(group), group.get("condition")))
    return errors


def _unknown(package: Package, root: Element) -> list[str]:
    """Return an error for each tag or attribute that the format does not define."""
    number = package.package_format or 1
    errors = []
    allowed = {
        "version": {"compatibility"},
        "maintainer": {"email"},
        "author": {"email"},
        "url": {"type"},
        "license": {"file"},
        "group_depend": {"condition"},
        "member_of_group": {"condition"},
    }
    of_dependencies = {*_VERSIONS, *(["condition"] if number == 3 else [])}
    tags = {*_DEPENDENCIES, *_ONLY_FORMAT_1, "depend"}
    for each in root:
        others = sorted(
            set(each.attrib) - allowed.get(each.tag, of_dependencies if each.tag in tags else set())
        )
        if others and each.tag in _KNOWN[number]:
            errors.append(f'The "{each.tag}" tag must not have the following attributes: {", ".join(others)}')
    unknown = sorted({each.tag for each in root} - _KNOWN[number])
    if unknown:
        errors.append(
            f'The manifest of package "{package.name}" (with format version {number}) must not contain the following '
            f"tags: {', '.join(unknown)}"
        )
    if "run_depend" in unknown:
        errors.append("Please replace <run_depend> tags with <exec_depend> tags.")
    return errors


def _dependency(element: Element) -> Dependency:
    known = {name: element.get(name) for name in (*_VERSIONS, "condition")}
    return Dependency(_text(element), **known)


def _parsed(data: str | bytes, filename: str | None) -> Element:
    builder = TreeBuilder()
    parser = new_parser()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(data, True)
    except (ExpatError, XmlError, ValueError, LookupError) as error:
        raise InvalidPackage(f"The manifest contains invalid XML:\n{error}", filename) from error
    return builder.close()


def _text(element: Element) -> str:
    return "".join(element.itertext()).strip()


def _inside(element: Element) -> str:
    """Return an element's inner XML."""
    return (
        escape(element.text or "")
        + "".join(tostring(each, encoding="unicode").replace(" />", "/>") for each in element)
    ).strip()
