"""Parses a launch file's text into tags with line numbers. Pure.

Source: http://wiki.ros.org/roslaunch/XML.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

from minirospy.base.errors import LaunchError, NotFoundError
from minirospy.base.suggestions import nearest
from minirospy.base.xml_text import XmlElement as Element
from minirospy.base.xml_text import XmlError, XmlSyntaxError, parse_xml
from minirospy.ros.roslaunch.launcher.substitution import Substitution, SubstitutionError

__all__ = ["ATTRIBUTES", "Element", "Tag", "parse_document"]

_N = TypeVar("_N", int, float)
_NODE = [
    "pkg", "type", "name", "args", "machine", "respawn", "respawn_delay", "required", "ns", "clear_params", "output",
    "cwd", "launch-prefix",
]  # fmt: skip
ATTRIBUTES: dict[str, frozenset[str]] = {
    tag: frozenset({*names, "if", "unless"})
    for tag, names in {
        "launch": ["deprecated"],
        "arg": ["name", "value", "default", "doc"],
        "param": ["name", "value", "type", "textfile", "binfile", "command"],
        "rosparam": ["command", "file", "param", "ns", "subst_value"],
        "node": _NODE,
        "test": [*_NODE, "test-name", "time-limit", "retry"],
        "remap": ["from", "to"],
        "env": ["name", "value"],
        "group": ["ns", "clear_params"],
        "include": ["file", "ns", "clear_params", "pass_all_args"],
        "machine": ["name", "address", "env-loader", "ssh-port", "user", "password", "default", "timeout"],
        "master": ["auto", "type", "uri"],
    }.items()
}
"""The allowed attributes, keyed by tag name."""

_TRUTH = {"true": True, "false": False}
_CONDITIONS = {**_TRUTH, "1": True, "0": False}


def parse_document(text: bytes, file: str) -> Element:
    """Return a launch file's ``<launch>`` element. Raise LaunchError if the XML is invalid or has another root element."""
    try:
        root = parse_xml(text)
    except XmlSyntaxError as error:
        raise LaunchError(file, error.line, f"Invalid roslaunch XML syntax: {error.why}") from None
    except XmlError as error:
        raise LaunchError(file, error.line, error.why) from None
    if root.tag != "launch":
        why = f"Invalid roslaunch XML syntax: no root <launch> tag, but <{root.tag}>"
        raise LaunchError(file, root.line, why)
    return root


class Tag:
    """An XML element. Resolves substitutions in its attributes and adds its line number to errors."""

    def __init__(self, element: Element, file: str, substitution: Substitution) -> None:
        self.element = element
        self.file = file
        self._substitution = substitution

    @property
    def name(self) -> str:
        """Return the tag's name."""
        return self.element.tag

    @property
    def line(self) -> int:
        """Return the line where the tag starts."""
        return self.element.line

    def children(self) -> Iterator[Tag]:
        """Yield the child tags."""
        return (Tag(child, self.file, self._substitution) for child in self.element.children)

    def has(self, key: str) -> bool:
        """Return whether the attribute is present, even if it is empty."""
        return key in self.element.attributes

    def resolve(self, text: str) -> str:
        """Return a string with its substitutions resolved. Raise LaunchError if a substitution cannot be resolved."""
        try:
            return self._substitution.apply(text)
        except (SubstitutionError, NotFoundError) as error:
            raise self.error(str(error)) from error

    def optional(self, key: str) -> str | None:
        """Return an attribute with its substitutions resolved, or None if the tag does not have the attribute.

        Raise LaunchError if a substitution cannot be resolved.
        """
        text = self.element.attributes.get(key)
        return None if text is None else self.resolve(text)

    def required(self, key: str, *, may_be_empty: bool = False) -> str:
        """Return a required attribute. Raise LaunchError if it is missing, or empty unless ``may_be_empty``."""
        text = self.optional(key)
        if text is None:
            unknown = self.element.attributes.keys() - ATTRIBUTES[self.name]
            near = nearest(key, unknown)
            hint = f" (there is '{near[0]}')" if near else ""
            raise self.error(f"<{self.name}> tag is missing required attribute: '{key}'{hint}")
        if not text and not may_be_empty:
            raise self.error(f"<{self.name}> tag has an empty '{key}' attribute")
        return text

    def flag(self, key: str) -> bool:
        """Return a boolean attribute, or False if the tag does not have the attribute.

        Raise LaunchError if it is not a boolean.
        """
        text = self.optional(key)
        if text is None:
            return False
        value = _TRUTH.get(text.strip().lower())
        if value is None:
            raise self.error(f"invalid bool value for {key}: {text} (it is 'true' or 'false')")
        return value

    def number(self, key: str, default: float) -> float:
        """Return a numeric attribute, or the default if the tag does not have the attribute.

        Raise LaunchError if it is not a number.
        """
        text = self.optional(key)
        try:
            return default if text is None else float(text)
        except ValueError:
            raise self.error(f"invalid float value for {key}: {text}") from None

    def number_or_empty(self, key: str, default: _N, kind: type[_N]) -> _N:
        """Return an attribute as a number of type ``kind``, or the default if the attribute is missing or empty.

        Raise LaunchError for anything but a number.
        """
        text = self.optional(key)
        try:
            return kind(text) if text else default
        except ValueError:
            raise self.error(f"'{key}' must be a number: [{text}]") from None

    def choice(self, key: str, choices: tuple[str, ...]) -> str:
        """Return an attribute that is one of ``choices``; the default is the first choice.

        Raise LaunchError for any other value.
        """
        text = self.optional(key)
        if text is not None and text not in choices:
            raise self.error(f"{key} must be one of {', '.join(map(repr, choices))}, not '{text}'")
        return text or choices[0]

    def applies(self) -> bool:
        """Return whether the tag applies, according to its ``if`` or ``unless`` attribute.

        Raise LaunchError if the tag has both attributes, or one with an invalid value.
        """
        if self.has("if") and self.has("unless"):
            raise self.error("cannot set both 'if' and 'unless' on the same tag")
        for key in ("if", "unless"):
            text = self.optional(key)
            if text is not None:
                value = _CONDITIONS.get(text.strip().lower())
                if value is None:
                    raise self.error(
                        f"{key}: {text} is not a 'bool' type (it is 'true', 'false', '1' or '0')"
                    )
                return value == (key == "if")
        return True

    def unknown_attributes(self) -> Iterator[tuple[LaunchError, str]]:
        """Yield (warning, attribute name) for each unsupported attribute; most are typos."""
        known = ATTRIBUTES[self.name]
        for key in self.element.attributes:
            if key not in known:
                near = nearest(key, known)
                hint = f": did you mean {' or '.join(near)}?" if near else ""
                yield self.error(f"unknown <{self.name}> attribute '{key}'{hint}"), key

    def error(self, text: str) -> LaunchError:
        """Return an error about this tag, to be raised by the caller."""
        return LaunchError(self.file, self.line, text)
