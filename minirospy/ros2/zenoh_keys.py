"""The Zenoh keys and attachments that rmw_zenoh uses for topics, services, nodes and their endpoints. Pure.

Source: https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md, and liveliness_utils.cpp in the same repository.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

__all__ = [
    "Entity",
    "Kind",
    "Qos",
    "attachment",
    "data_key",
    "dds_name",
    "format_token",
    "gid_of",
    "parse_token",
    "reply_attachment",
    "tokens_pattern",
    "xxh3_128",
]

_SPACE = "@ros2_lv"
_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_DDS_NAME = re.compile(r"([A-Za-z]\w*)::(msg|srv|action)::dds_::([A-Za-z]\w*)_", re.ASCII)
_HASH = re.compile(r"RIHS01_[0-9a-f]{64}|TypeHashNotSupported")
_MAX_LENGTH = 2000
_DEFAULT_DEPTH = 42


class Kind(Enum):
    """The kinds of entities that tokens declare."""

    NODE = "NN"
    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVICE = "SS"
    CLIENT = "SC"


@dataclass(frozen=True)
class Qos:
    """The QoS settings of an endpoint that the bridge uses."""

    is_reliable: bool = True
    is_transient_local: bool = False
    depth: int = 10

    def __str__(self) -> str:
        """Return the settings in a token's format, in which only settings that differ from rmw_zenoh's defaults are listed."""
        depth = "" if self.depth == _DEFAULT_DEPTH else str(self.depth)
        return f"{'' if self.is_reliable else 2}:{1 if self.is_transient_local else ''}:,{depth}:,:,:,,"


class Entity(NamedTuple):
    """A node, or an endpoint: a publisher, subscriber, service or client.

    ``type`` is ``pkg/Name``, ``pkg/srv/Name`` or ``pkg/action/Name``. ``session`` is the id of the entity's Zenoh session.
    """

    domain: str
    session: str
    id: int
    kind: Kind
    node: str
    namespace: str = "/"
    name: str = ""
    type: str = ""
    hash: str = ""
    qos: Qos = Qos()

    @property
    def short_type(self) -> str:
        """Return the type as ``pkg/Name``."""
        package, _, rest = self.type.partition("/")
        return f"{package}/{rest.rpartition('/')[2]}"

    @property
    def key(self) -> str:
        """Return the key of the entity's messages or requests."""
        return data_key(self.domain, self.name, self.type, self.hash)


def tokens_pattern(domain: str) -> str:
    """Return a key expression that matches all tokens in a domain."""
    return f"{_SPACE}/{domain}/**"


def data_key(domain: str, name: str, type_: str, hash_: str) -> str:
    """Return the key on which a topic's messages or a service's requests are sent."""
    return f"{domain}/{name.strip('/')}/{dds_name(type_)}/{hash_}"


def dds_name(type_: str) -> str:
    """Convert a type name to DDS: ``pkg/Name`` to ``pkg::msg::dds_::Name_``, ``pkg/srv/Name`` to ``pkg::srv::dds_::Name_``."""
    package, _, rest = type_.partition("/")
    kind, _, name = rest.rpartition("/")
    return f"{package}::{kind or 'msg'}::dds_::{name}_"


def format_token(entity: Entity) -> str:
    """Return the key of an entity's token."""
    node_id = entity.id if entity.kind is Kind.NODE else 0
    parts = [_SPACE, entity.domain, entity.session, str(node_id), str(entity.id), entity.kind.value, "%"]
    parts += [_mangled(entity.namespace), entity.node]
    if entity.kind is not Kind.NODE:
        parts += [_mangled(entity.name), dds_name(entity.type), entity.hash, str(entity.qos)]
    return "/".join(parts)


def parse_token(key: str) -> Entity | None:
    """Parse a token's key; return None if the bridge does not support its format."""
    parts = key.split("/")
    if len(key) > _MAX_LENGTH or len(parts) < 9 or parts[0] != _SPACE:
        return None
    _, domain, session, _, id, kind, _, namespace, node, *rest = parts
    if kind not in {each.value for each in Kind} or not (id.isascii() and id.isdigit()) or len(id) > 18:
        return None
    head = (domain, session, int(id), Kind(kind), node, namespace.replace("%", "/"))
    if kind == Kind.NODE.value:
        return Entity(*head)
    # Ignore additional parts, which newer versions may append.
    if len(rest) < 4:
        return None
    name, found, qos = rest[0].replace("%", "/"), _DDS_NAME.fullmatch(rest[1]), _parse_qos(rest[3])
    if not _NAME.fullmatch(name) or not found or not _HASH.fullmatch(rest[2]) or qos is None:
        return None
    package, part, type_ = found.groups()
    whole = f"{package}/{type_}" if part == "msg" else f"{package}/{part}/{type_}"
    return Entity(*head, name, whole, rest[2], qos)


def _parse_qos(text: str) -> Qos | None:
    parts = text.split(":")
    if len(parts) < 6:
        return None
    _, _, depth = parts[2].partition(",")
    return Qos(
        parts[0] in ("", "1"),
        parts[1] == "1",
        int(depth) if depth.isascii() and depth.isdigit() and len(depth) < 10 else _DEFAULT_DEPTH,
    )


def _mangled(name: str) -> str:
    return name.replace("/", "%")


def gid_of(token: str) -> bytes:
    """Return the gid of the entity that a token declares."""
    return xxh3_128(token.encode())


def xxh3_128(data: bytes) -> bytes:
    """Return the 128-bit XXH3 hash in little-endian byte order, as in rmw_zenoh."""
    # xxhash comes with the extra `fleet`; the rest of this module works without it.
    import xxhash

    return xxhash.xxh3_128_intdigest(data).to_bytes(16, "little")


# --- attachments

_ATTACHMENT = struct.Struct("<qqB16s")
_TIME = slice(8, 16)


def attachment(sequence: int, time: int, gid: bytes) -> bytes:
    """Return the attachment for a message or request. ``time`` is in nanoseconds since 1970."""
    return _ATTACHMENT.pack(sequence, time, len(gid), gid)


def reply_attachment(data: bytes, time: int) -> bytes:
    """Return the attachment for the response to a request with the attachment ``data``.

    Raise ValueError if ``data`` is invalid.
    """
    # Some versions of rmw_zenoh send the gid without its length. Reply in the request's format.
    if len(data) not in (_ATTACHMENT.size, _ATTACHMENT.size - 1):
        raise ValueError("this is not an attachment of rmw_zenoh")
    return data[: _TIME.start] + struct.pack("<q", time) + data[_TIME.stop :]
