"""Objects that are converted to and from XML, according to tables of their attributes and child elements.

Error messages and their paths (``/robot[@name='r']/link[1]``) are those of urdf_parser_py.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any, ClassVar, Generic, TypeVar
from xml.dom import minidom
from xml.etree import ElementTree as ET

from minirospy.base.xml_text import XmlError, check_xml

__all__ = ["Object", "ParseError", "Path", "on_error", "on_error_stderr", "to_yaml", "xml_string"]

_T = TypeVar("_T", bound="Object")
_V = TypeVar("_V")


def on_error_stderr(message: str) -> None:
    """Print an error about an unknown or invalid part of a description to stderr."""
    sys.stderr.write(message + "\n")


on_error: Callable[[str], object] = on_error_stderr
"""The error handler. Programs replace it, here or in the module that they import."""


def report(message: str) -> None:
    """Report an error through on_error, which a program may have replaced."""
    module = sys.modules.get("urdf_parser_py.xml_reflection.core")
    replaced = getattr(module, "on_error", on_error_stderr)
    (on_error if replaced is on_error_stderr else replaced)(message)


class Path:
    """The path to an element in a description."""

    def __init__(self, tag: str, parent: Path | None = None, suffix: str = "") -> None:
        self.tag = tag
        self.parent = parent
        self.suffix = suffix

    def __str__(self) -> str:
        above = "" if self.parent is None else str(self.parent)
        return f"{above}/{self.tag}{self.suffix}"


class ParseError(Exception):
    """Raised if a description cannot be parsed. ``e`` is the cause, ``path`` the path to the element."""

    def __init__(self, e: Exception, path: Path) -> None:
        self.e = e
        self.path = path
        super().__init__(f"ParseError in {path}:\n{e}")


class Codec(Generic[_V]):
    """Converts values to and from XML elements or the strings of XML attributes."""

    def from_string(self, text: str) -> _V:
        """Convert a string to a value. Raise ValueError if the string is invalid."""
        raise NotImplementedError

    def to_string(self, value: _V) -> str:
        """Convert a value to a string."""
        return str(value)

    def from_xml(self, node: ET.Element, path: Path) -> _V:
        """Convert an element to a value."""
        return self.from_string(node.text or "")

    def write_xml(self, node: ET.Element, value: _V) -> None:
        """Write a value into an element."""
        node.text = self.to_string(value)


class Text(Codec[str]):
    """A codec that keeps strings unchanged."""

    def from_string(self, text: str) -> str:
        """Return the string."""
        return text


class Number(Codec[float]):
    """A codec for a number."""

    def from_string(self, text: str) -> float:
        """Convert a string to a number. Raise ValueError if the string is not a number."""
        return float(text)


class VectorOf(Codec[Iterable[float]]):
    """A codec for a fixed-length list of numbers."""

    def __init__(self, count: int) -> None:
        self._count = count

    def from_string(self, text: str) -> list[float]:
        """Convert a string to numbers. Raise AssertionError if there are too few or too many, ValueError if one is invalid."""
        words = text.split()
        if len(words) != self._count:
            raise AssertionError("Invalid vector length")
        return [float(word) for word in words]

    def to_string(self, value: Iterable[float]) -> str:
        """Return the numbers separated by spaces."""
        words = [str(number) for number in value]
        if len(words) != self._count:
            raise AssertionError("Invalid vector length")
        return " ".join(words)


class NamedAttribute(Codec[_V]):
    """A codec for an element whose value is a single attribute, such as ``<parent link="base"/>``."""

    def __init__(self, attribute: str, codec: Codec[_V]) -> None:
        self._attribute = attribute
        self._codec = codec

    def from_xml(self, node: ET.Element, path: Path) -> _V:
        """Return the attribute's value."""
        text = node.get(self._attribute)
        if text is None:
            raise ParseError(Exception(f"Required attribute not set in XML: {self._attribute}"), path)
        return self._codec.from_string(text)

    def write_xml(self, node: ET.Element, value: _V) -> None:
        """Write the value as an attribute."""
        node.set(self._attribute, self._codec.to_string(value))


class Raw(Codec[ET.Element]):
    """A codec that keeps elements unchanged."""

    def from_xml(self, node: ET.Element, path: Path) -> ET.Element:
        """Return the element itself."""
        return node

    def write_xml(self, node: ET.Element, value: ET.Element) -> None:
        """Write a copy of the element."""
        node.extend(list(value))
        node.text = value.text
        node.attrib.update(value.attrib)


class ObjectOf(Codec["Object"]):
    """A codec that converts an element to an object of a given class, and back."""

    def __init__(self, kind: type[Object]) -> None:
        self.kind = kind

    def from_xml(self, node: ET.Element, path: Path) -> Object:
        """Return the object for an element."""
        found = self.kind()
        found.read_xml(node, path)
        return found

    def write_xml(self, node: ET.Element, value: Object) -> None:
        """Write the object into an element."""
        value.write_xml(node)


@dataclass(frozen=True)
class Attribute:
    """An attribute of an XML element, stored as an attribute of the Python object."""

    name: str
    codec: Codec[Any]
    required: bool = True
    default: object = None
    kind: ClassVar[str] = "attribute"


@dataclass(frozen=True)
class Element:
    """A child element that occurs at most once."""

    name: str
    codec: Codec[Any]
    required: bool = True
    default: object = None
    kind: ClassVar[str] = "element"


@dataclass(frozen=True)
class Many:
    """Child elements that may occur any number of times, stored as a list in the attribute ``name`` + "s"."""

    name: str
    codec: Codec[Any]


class Object:
    """An XML element as an object. ``TAG`` is the element's tag; ``FIELDS`` describes its attributes and children."""

    TAG: ClassVar[str] = ""
    FIELDS: ClassVar[tuple[Attribute | Element | Many, ...]] = ()

    # --- parsing XML

    @classmethod
    def from_xml_string(cls: type[_T], xml_string: str | bytes) -> _T:
        """Return the object parsed from an XML string.

        Raise ParseError if the description is invalid, xml.etree.ElementTree.ParseError if the string is not XML.
        """
        return cls.from_xml(_root(xml_string), Path(cls.TAG))

    @classmethod
    def from_xml_file(cls: type[_T], file_path: str) -> _T:
        """Return the object parsed from a file.

        Raise OSError if the file cannot be read, and the errors that from_xml_string raises.
        """
        return cls.from_xml_string(File(file_path).read_bytes())

    @classmethod
    def from_xml(cls: type[_T], node: ET.Element, path: Path) -> _T:
        """Return the object parsed from an element. Raise ParseError if the element is invalid."""
        found = cls()
        found.read_xml(node, path)
        return found

    def parse(self: _T, xml_string: str | bytes) -> _T:
        """Parse an XML string into this object; return the object. Raise the same exceptions as from_xml_string."""
        self.read_xml(_root(xml_string), Path(self.TAG))
        return self

    def read_xml(self, node: ET.Element, path: Path) -> None:
        """Parse an element into this object. Raise ParseError if the element is invalid."""
        self._read_attributes(node, path)
        self._read_elements(node, path)
        attributes = {each.name for each in self.FIELDS if isinstance(each, Attribute)}
        for name in [name for name in node.attrib if name not in attributes]:
            report(f'Unknown attribute "{name}" in {path}')
        known = {each.name for each in self.FIELDS if not isinstance(each, Attribute)}
        for child in node:
            if child.tag not in known and isinstance(child.tag, str):
                report(f'Unknown tag "{child.tag}" in {path}')
        self.post_read_xml()
        try:
            self.check_valid()
        except ParseError:
            raise
        except Exception as error:
            raise ParseError(error, path) from error

    def _read_attributes(self, node: ET.Element, path: Path) -> None:
        for field in self.FIELDS:
            if not isinstance(field, Attribute):
                continue
            text = node.get(field.name)
            if text is None:
                self._set_default(field, path)
                continue
            try:
                value = field.codec.from_string(text)
            except (ValueError, AssertionError) as error:
                raise ParseError(
                    error, Path(path.tag, path.parent, f"{path.suffix}[@{field.name}]")
                ) from error
            setattr(self, field.name, value)
            if field.name == "name":
                path.suffix = f"[@name='{value}']"

    def _read_elements(self, node: ET.Element, path: Path) -> None:
        fields = {field.name: field for field in self.FIELDS if not isinstance(field, Attribute)}
        seen = set()
        for child in node:
            field = fields.get(child.tag)
            if isinstance(field, Many):
                number = len(self.get_aggregate_list(field.name)) + 1
                value = field.codec.from_xml(child, Path(child.tag, path, f"[{number}]"))
                self.add_aggregate(field.name, value)
            elif field is not None and child.tag in seen:
                report(f"Scalar element defined multiple times: {child.tag}")
            elif field is not None:
                seen.add(child.tag)
                setattr(self, field.name, field.codec.from_xml(child, Path(child.tag, path)))
        for field in fields.values():
            if isinstance(field, Element) and field.name not in seen:
                self._set_default(field, path)

    def _set_default(self, field: Attribute | Element, path: Path) -> None:
        if field.required:
            raise ParseError(Exception(f"Required {field.kind} not set in XML: {field.name}"), path)
        default = field.default
        setattr(self, field.name, [*default] if isinstance(default, list) else default)

    def post_read_xml(self) -> None:
        """Do nothing; user subclasses override this method to run code after reading."""

    def check_valid(self) -> None:
        """Raise an exception if the object is invalid."""

    def pre_write_xml(self) -> None:
        """Do nothing; user subclasses override this method to run code before writing."""

    # --- writing XML

    def to_xml(self) -> ET.Element:
        """Convert the object to an element."""
        node = ET.Element(self.TAG)
        self.write_xml(node)
        return node

    def to_xml_string(self, addHeader: bool = True) -> str:
        """Convert the object to an indented XML string."""
        return xml_string(self.to_xml(), addHeader)

    def write_xml(self, node: ET.Element) -> None:
        """Write the object into an element. Raise an exception if a required part is None."""
        self.check_valid()
        self.pre_write_xml()

        for field in self.FIELDS:
            if isinstance(field, Many):
                continue
            value = getattr(self, field.name)
            if value is None and field.required:
                what = "attribute not set" if isinstance(field, Attribute) else "element not defined"
                raise Exception(f"Required {what} in object: {field.name}")
            value = field.default if value is None else value
            if value is None:
                continue
            if isinstance(field, Attribute):
                node.set(field.name, field.codec.to_string(value))
            else:
                field.codec.write_xml(ET.SubElement(node, field.name), value)
        codecs = {field.name: field.codec for field in self.FIELDS if isinstance(field, Many)}
        for name, value in self._aggregates() if codecs else ():
            codecs[name].write_xml(ET.SubElement(node, name), value)

    # --- lists of child elements, in the order in which they were added

    def aggregate_init(self) -> None:
        """Create the empty lists of child elements."""
        self.aggregate_order: list[object] = []
        self.aggregate_type: dict[object, str] = {}

    def get_aggregate_list(self, xml_var: str) -> list[object]:
        """Return the list of child elements with this tag."""
        found: list[object] = getattr(self, f"{xml_var}s")
        return found

    def add_aggregate(self, xml_var: str, obj: object) -> None:
        """Add a child element with this tag."""
        self.get_aggregate_list(xml_var).append(obj)
        self.aggregate_order.append(obj)
        self.aggregate_type[obj] = xml_var

    def remove_aggregate(self, obj: object) -> None:
        """Remove a child element."""
        self.aggregate_order.remove(obj)
        self.get_aggregate_list(self.aggregate_type.pop(obj)).remove(obj)

    def lump_aggregates(self) -> None:
        """Reorder the child elements, so that those with the same tag are adjacent."""
        self.aggregate_init()
        for field in self.FIELDS:
            if isinstance(field, Many):
                for each in self.get_aggregate_list(field.name):
                    self.aggregate_order.append(each)
                    self.aggregate_type[each] = field.name

    def _aggregates(self) -> list[tuple[str, object]]:
        return [(self.aggregate_type[each], each) for each in self.aggregate_order]

    # --- human-readable output

    def to_yaml(self) -> object:
        """Convert the object to YAML-compatible data."""
        names = [f"{each.name}s" if isinstance(each, Many) else each.name for each in self.FIELDS]
        return to_yaml({name: getattr(self, name) for name in names})

    def __str__(self) -> str:
        import yaml

        return str(yaml.dump(self.to_yaml())).rstrip()


def to_yaml(obj: object) -> object:
    """Convert a value to YAML-compatible data."""
    if isinstance(obj, bool | int | float):
        return obj
    if isinstance(obj, Object):
        return obj.to_yaml()
    if isinstance(obj, Mapping):
        return {str(key): to_yaml(value) for key, value in obj.items()}
    if hasattr(obj, "tolist"):
        return to_yaml(obj.tolist())
    if isinstance(obj, Iterable) and not isinstance(obj, str | ET.Element):
        return [to_yaml(each) for each in obj]
    return str(obj)


def _root(xml_string: str | bytes) -> ET.Element:
    try:
        check_xml(xml_string)
    except XmlError as error:
        raise ET.ParseError(str(error)) from None
    return ET.fromstring(xml_string)


def xml_string(rootXml: ET.Element, addHeader: bool = True) -> str:
    """Return an element as an indented XML string, without blank lines."""
    lines = minidom.parseString(ET.tostring(rootXml)).toprettyxml(indent="  ").split("\n")
    if lines[0].startswith("<?xml") and not addHeader:
        del lines[0]
    return "\n".join(line for line in lines if line.strip())
