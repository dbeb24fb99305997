"""republish: republishes images with another transport. Source: http://wiki.ros.org/image_transport (republish).

    republish IN_TRANSPORT in:=IN_BASE_TOPIC [OUT_TRANSPORT] out:=OUT_BASE_TOPIC

If OUT_TRANSPORT is omitted, the image is published with all transports: raw on the base topic, the others in its
namespace. The parameters are those of ROS's plug-ins, below the output topic (``OUT/compressed/jpeg_quality``) or private
(``~compressed/jpeg_quality``).
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from typing import TypeAlias

from sensor_msgs.msg import CompressedImage, Image

from minirospy import client as rospy
from minirospy.base.errors import ROSInterruptException
from minirospy.client.topics import AnyMsg
from minirospy.core.images.compressed import require_library
from minirospy.ros.image_transport.codecs import (
    CodecError,
    Settings,
    compressed,
    compressed_depth,
    uncompressed,
    uncompressed_depth,
)

__all__ = ["Republisher", "list_main", "main", "settings_of"]

_USAGE = "Usage: republish in_transport in:=<in_base_topic> [out_transport] out:=<out_base_topic>"
_NUMBERS = {
    "jpeg_quality": (1, 100),
    "png_level": (1, 9),
    "depth_max": (1, 100),
    "depth_quantization": (1, 150),
}
"""The limits for the plug-ins' numeric parameters."""
_KINDS = {"format": str, "jpeg_progressive": bool, "jpeg_optimize": bool}

Encode: TypeAlias = Callable[[Image, Settings], CompressedImage]
Decode: TypeAlias = Callable[[CompressedImage], Image]

_ENCODERS: dict[str, Encode] = {"compressed": compressed, "compressedDepth": compressed_depth}
_DECODERS: dict[str, Decode] = {"compressed": uncompressed, "compressedDepth": uncompressed_depth}
_TRANSPORTS = {
    "raw": "The Image as it is, on the base topic.",
    "compressed": "A CompressedImage, JPEG or PNG, on <base topic>/compressed.",
    "compressedDepth": "A CompressedImage of a depth image, PNG, on <base topic>/compressedDepth.",
}


def main() -> int:
    """Run the program; return its exit status."""
    words = rospy.myargv()[1:]
    if len(words) not in (1, 2):
        print(_USAGE)
        return 0 if not words else 1
    if unknown := [word for word in words if word not in _TRANSPORTS]:
        print(
            f"ERROR: Unable to load plugin for transport '{unknown[0]}': there is {', '.join(_TRANSPORTS)}",
            file=sys.stderr,
        )
        return 1
    try:
        rospy.init_node("image_republisher", anonymous=True)
        if set(words[:1] + (words[1:] or list(_TRANSPORTS))) != {"raw"}:
            _warn_without_library()
        running = Republisher("in", words[0], "out", words[1:] or list(_TRANSPORTS))
        rospy.spin()
        del running
    except ROSInterruptException:
        pass
    return 0


def _warn_without_library() -> None:
    """Warn if the image library is missing.

    Without the warning, the fault would go unnoticed until a subscriber arrives, because only then are images encoded.
    """
    try:
        require_library()
    except ValueError as error:
        rospy.logwarn("%s", error)


def list_main() -> int:
    """Print the transports, like the program list_transports; return the exit status."""
    print("Declared transports:")
    for name in _TRANSPORTS:
        print(f"image_transport/{name}")
    print("\nDetails:\n----------")
    for name, text in _TRANSPORTS.items():
        print(f'"image_transport/{name}"\n - Publisher and subscriber: {text}')
    return 0


class Republisher:
    """Republishes images with one or more transports; encodes them only for transports with subscribers."""

    def __init__(self, source: str, source_kind: str, target: str, kinds: Sequence[str]) -> None:
        self._kind = source_kind
        self._target = rospy.resolve_name(target)
        self._outputs = {kind: _advertised(self._target, kind) for kind in kinds}
        self._input = rospy.Subscriber(
            _topic(rospy.resolve_name(source), source_kind),
            _bytes_of(_class_of(source_kind)),
            self._received,
            queue_size=1,
            buff_size=1 << 24,
        )

    def _received(self, message: AnyMsg) -> None:
        wanted = [kind for kind, output in self._outputs.items() if output.get_num_connections()]
        try:
            image: Image | None = None
            for kind in wanted:
                if kind == self._kind == "raw":
                    self._outputs[kind].publish(message)
                    continue
                image = image or self._image(message)
                self._publish(kind, image)
        except CodecError as error:
            rospy.logerr_throttle(10, f"[{self._input.resolved_name}] {error}")

    def _image(self, message: AnyMsg) -> Image:
        data = message._buff or b""
        if self._kind == "raw":
            image = Image()
            image.deserialize(data)
            return image
        received = CompressedImage()
        received.deserialize(data)
        return _DECODERS[self._kind](received)

    def _publish(self, kind: str, image: Image) -> None:
        made: Image | CompressedImage = image
        if kind != "raw":
            made = _ENCODERS[kind](image, self._settings(kind))
        # Publish the serialized bytes, to keep the received sequence number.
        buffer = BytesIO()
        made.serialize(buffer)
        passed = AnyMsg()
        passed._buff = buffer.getvalue()
        self._outputs[kind].publish(passed)

    def _settings(self, kind: str) -> Settings:
        values: dict[str, object] = {}
        for name in (f"~{kind}", _topic(self._target, kind)):
            found = rospy.get_param_cached(name, {})
            if isinstance(found, dict):
                values |= found
        return settings_of(values)


def settings_of(values: Mapping[str, object]) -> Settings:
    """Read the settings from the parameters and clamp them to their limits.

    Raise CodecError if a parameter has the wrong type.
    """
    chosen: dict[str, object] = {}
    for name, value in values.items():
        if name in _NUMBERS:
            low, high = _NUMBERS[name]
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise CodecError(f"the parameter {name} is not a number: {value!r}")
            number = min(max(value, low), high)
            chosen[name] = float(number) if name.startswith("depth") else int(number)
        elif name in _KINDS:
            if not isinstance(value, _KINDS[name]):
                raise CodecError(f"the parameter {name} is not a {_KINDS[name].__name__}: {value!r}")
            chosen[name] = value
    return dataclasses.replace(Settings(), **chosen)  # type: ignore[arg-type]


def _topic(base: str, kind: str) -> str:
    return base if kind == "raw" else f"{base}/{kind}"


def _class_of(kind: str) -> type[Image] | type[CompressedImage]:
    return Image if kind == "raw" else CompressedImage


def _bytes_of(cls: type[Image] | type[CompressedImage]) -> type[AnyMsg]:
    """Return a message class with the type and md5sum of ``cls``; its messages contain only the serialized bytes."""
    fields = {"_type": cls._type, "_md5sum": cls._md5sum, "_full_text": cls._full_text, "__slots__": []}
    return type("PassedImage", (AnyMsg,), fields)


def _advertised(base: str, kind: str) -> rospy.Publisher[AnyMsg]:
    return rospy.Publisher(_topic(base, kind), _bytes_of(_class_of(kind)), queue_size=1)
