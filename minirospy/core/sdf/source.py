"""A file that is being read: typed values of its elements, files that its URIs refer to, and warnings about skipped parts."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from minirospy.base.errors import SdfError
from minirospy.core.sdf.model import IDENTITY, Color, Pose, Vector
from minirospy.core.sdf.poses import normalized, pose_from_rpy
from minirospy.core.sdf.text import Element, parse_document

__all__ = ["MAX_PARTS", "Resolve", "Shared", "Source", "no_files"]

Resolve = Callable[[str], "str | None"]
"""Returns the path of the existing file or folder that a URI or path refers to, or None.

URIs start with ``model://``, ``package://`` or ``file://``.
"""

MAX_FILE_BYTES = 64 * 1024 * 1024  # Gazebo users' largest worlds have about 10 MB
MAX_INCLUDES = 16  # maximum nesting of files and models; a greater depth is a mistake or an attack
MAX_WARNINGS = 200  # maximum warnings per model or world; nobody reads more
MAX_PARTS = 20_000  # maximum links, joints and models per world or spawn request
_INFINITE = 1e16  # sdformat writes infinite limits as this number; larger numbers overflow in the simulation
_TRUE = ("1", "true", "yes")
_FALSE = ("0", "false", "no", "")


def no_files(uri: str) -> str | None:
    """Resolve a URI without search paths: return ``uri`` if it is an absolute path that exists."""
    path = uri.removeprefix("file://")
    return path if os.path.isabs(path) and os.path.exists(path) else None


@dataclass
class Shared:
    """Data shared by all files that are read together: documents and found paths by name, and the number of parts so far."""

    documents: dict[str, Element] = field(default_factory=dict)
    found: dict[str, str | None] = field(default_factory=dict)
    max_parts: int = MAX_PARTS
    parts: int = 0

    @property
    def is_full(self) -> bool:
        return self.parts > self.max_parts


@dataclass(frozen=True)
class Source:
    """A file that is being read, with its folder, its SDF version, and the files that include it.

    file: its name in messages. folder: the base of relative URIs, or an empty string. version: its SDF version. chain: the paths
    of the including files, ending with its own. depth: the number of enclosing models.
    """

    file: str
    resolve: Resolve
    warnings: list[str]
    shared: Shared
    folder: str = ""
    version: tuple[int, int] = (1, 7)
    chain: tuple[str, ...] = ()
    depth: int = 0

    def warn(self, element: Element | None, text: str) -> None:
        """Add a line about a part that is skipped or changed. Repeated lines are added once, up to a limit."""
        line = f"{self.file}:{element.line}: {text}" if element and element.line else f"{self.file}: {text}"
        if len(self.warnings) > MAX_WARNINGS or line in self.warnings:
            return
        if len(self.warnings) == MAX_WARNINGS:
            line = f"{self.file}: there are more than {MAX_WARNINGS} warnings: the others are not listed"
        self.warnings.append(line)

    def missing(self, uri: str) -> str:
        """Return the message for a missing file, with advice if there is any."""
        hint = " (add its folder to GAZEBO_MODEL_PATH)" if uri.startswith("model://") else ""
        return f"{uri} does not exist{hint}"

    def error(self, element: Element, text: str) -> SdfError:
        """Return the error for an unreadable element."""
        return SdfError(self.file, element.line, text)

    def count(self, element: Element, parts: int = 1) -> None:
        """Count links, joints and models. Raise SdfError if the total is too large."""
        self.shared.parts += parts
        if self.shared.is_full:
            raise self.error(element, f"there are more than {self.shared.max_parts} links, joints and models")

    # ---- other files

    def find(self, uri: str) -> str | None:
        """Return the path of the existing file or folder that a URI names, or None. Relative URIs start at this file's folder."""
        uri = uri.strip()
        if not uri:
            return None
        if self.folder and "://" not in uri and not os.path.isabs(uri):
            near = os.path.join(self.folder, uri)
            if os.path.exists(near):
                return near
        if uri not in self.shared.found:
            self.shared.found[uri] = self.resolve(uri)
        return self.shared.found[uri]

    def open(self, element: Element, path: str) -> tuple[Element, Source]:
        """Return the root element of an included file, and its source.

        Raise SdfError if the file is unreadable, is not XML, or includes itself.
        """
        path = os.path.realpath(path)
        if path in self.chain:
            names = " -> ".join(
                os.path.basename(os.path.dirname(each)) or each for each in (*self.chain, path)
            )
            raise self.error(element, f"{path} includes itself: {names}")
        if len(self.chain) >= MAX_INCLUDES:
            raise self.error(element, f"files include each other more than {MAX_INCLUDES} levels deep")
        if path not in self.shared.documents:
            self.shared.documents[path] = parse_document(_read(path), path)
        inner = replace(self, file=path, folder=os.path.dirname(path), chain=(*self.chain, path))
        return self.shared.documents[path], inner

    def inside(self, element: Element) -> Source:
        """Return the source of a nested model. Raise SdfError if the nesting is too deep."""
        if self.depth >= MAX_INCLUDES:
            raise self.error(element, f"models are nested more than {MAX_INCLUDES} levels deep")
        return replace(self, depth=self.depth + 1)

    # ---- values

    def name(self, element: Element) -> str:
        """Return the attribute ``name``. Raise SdfError if it is missing or empty."""
        name = element.attributes.get("name", "").strip()
        if not name:
            raise self.error(element, f"<{element.tag}> has no name")
        return name

    def text(self, element: Element | None, tag: str, default: str = "") -> str:
        """Return the text of the first child with this tag, or the default if there is none."""
        child = element.first(tag) if element else None
        return child.text.strip() if child is not None else default

    def flag(self, element: Element | None, tag: str, default: bool) -> bool:
        """Return the value of a Boolean child."""
        child = element.first(tag) if element else None
        if child is None:
            return default
        text = child.text.strip().lower()
        if text in _TRUE or text in _FALSE:
            return text in _TRUE
        raise self.error(child, f"<{tag}> is '{child.text.strip()}': write true or false")

    def number(self, element: Element | None, tag: str, default: float, *, infinite: bool = False) -> float:
        """Return a child's number. Raise SdfError if it is not a number, or if it is infinite although ``infinite`` is false."""
        if (child := _given(element, tag)) is None:
            return default
        return (self.numbers if infinite else self.finite)(child, (1,))[0]

    def amount(self, element: Element | None, tag: str, default: float, *, infinite: bool = False) -> float:
        """Return a child's number. If it is negative, add a warning and return 0. Raise SdfError as :meth:`number` does."""
        value = self.number(element, tag, default, infinite=infinite)
        if value < 0.0:
            self.warn(element, f"<{tag}> is {value:g}: it is 0 instead")
            return 0.0
        return value

    def vector(self, element: Element | None, tag: str, default: Vector) -> Vector:
        """Return a child's three numbers."""
        if (child := _given(element, tag)) is None:
            return default
        x, y, z = self.finite(child, (3,))
        return x, y, z

    def color(self, element: Element | None, tag: str, default: Color | None) -> Color | None:
        """Return a child's colour, which is opaque if it has no opacity."""
        if (child := _given(element, tag)) is None:
            return default
        red, green, blue, *opacity = (min(max(value, 0.0), 1.0) for value in self.finite(child, (3, 4)))
        return red, green, blue, opacity[0] if opacity else 1.0

    def pose_of(self, element: Element, default: Pose = IDENTITY) -> Pose:
        """Return the pose in the child ``<pose>``, or the default if there is none."""
        pose = element.first("pose")
        return default if pose is None else self.pose(pose)

    def pose(self, element: Element) -> Pose:
        """Return the pose in an element's text: ``x y z roll pitch yaw``, or with a quaternion (``rotation_format``)."""
        if not element.text.strip():
            return Pose()
        if element.attributes.get("rotation_format") == "quat_xyzw":
            x, y, z, qx, qy, qz, qw = self.finite(element, (7,))
            return Pose((x, y, z), normalized((qx, qy, qz, qw)))
        x, y, z, roll, pitch, yaw = self.finite(element, (6,))
        if element.attributes.get("degrees", "").strip().lower() in _TRUE:
            roll, pitch, yaw = math.radians(roll), math.radians(pitch), math.radians(yaw)
        return pose_from_rpy((x, y, z), (roll, pitch, yaw))

    def finite(self, element: Element, counts: tuple[int, ...]) -> list[float]:
        """Return an element's numbers. Raise SdfError if one is infinite, or as :meth:`numbers` does."""
        values = self.numbers(element, counts)
        if not all(map(math.isfinite, values)):
            raise self.error(element, f"<{element.tag}> has an infinite number: '{_short(element.text)}'")
        return values

    def numbers(self, element: Element, counts: tuple[int, ...]) -> list[float]:
        """Return an element's numbers; very large ones become infinite.

        Raise SdfError if a value is not a number or is NaN, or if there are too few or too many values.
        """
        values = []
        for part in element.text.split():
            try:
                value = float(part if "_" not in part else "")  # reject 1_000, which float() accepts
            except ValueError:
                raise self.error(
                    element, f"<{element.tag}> is '{_short(element.text)}': '{_short(part)}' is not a number"
                ) from None
            if math.isnan(value):
                raise self.error(element, f"<{element.tag}> is '{_short(element.text)}': NaN is not allowed")
            values.append(math.copysign(math.inf, value) if abs(value) >= _INFINITE else value)
        if len(values) not in counts:
            expected = " or ".join(map(str, counts))
            raise self.error(
                element,
                f"<{element.tag}> has {len(values)} numbers instead of {expected}: '{_short(element.text)}'",
            )
        return values


def _given(element: Element | None, tag: str) -> Element | None:
    """Return the first child with this tag, or None if it is missing or empty."""
    child = element.first(tag) if element else None
    return child if child is not None and child.text.strip() else None


def _read(path: str) -> bytes:
    try:
        if os.path.getsize(path) > MAX_FILE_BYTES:
            raise SdfError(path, 0, f"the file is larger than {MAX_FILE_BYTES // 1024 // 1024} MB")
        return Path(path).read_bytes()
    except OSError as error:
        raise SdfError(path, 0, f"cannot be read: {error.strerror or error}") from None


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."
