"""The Zenoh keys that a fleet uses for announcements, messages and queries. Pure.

Below the root, which other programs' wildcards do not match, each key names the robot and the gateway that represents it::

    robot/NAME/GATEWAY/START/HOST                 token: a robot exists
    control/NAME/GATEWAY/START/HOST               token: a control room exists
    topic/NAME/GATEWAY/TOPIC/TYPE/MD5/FLAGS       token: a topic of a robot; FLAGS of "p", "s", "l", "f"
    service/NAME/GATEWAY/SERVICE/TYPE/MD5         token: a service of a robot
    want/NAME/GATEWAY/TOPIC/READER                token: READER, a gateway, has subscribers of a topic
    offer/NAME/GATEWAY/TOPIC/WRITER/TYPE/MD5/FLAGS  token: WRITER has publishers of a topic that the robot subscribes to
    out/NAME/GATEWAY/MD5/TOPIC                    messages from a robot
    replay/NAME/GATEWAY/MD5/TOPIC/READER          its latched messages, for a READER that came later
    in/NAME/GATEWAY/MD5/TOPIC/WRITER              messages to a robot
    call/NAME/GATEWAY/SERVICE/MD5                 query: a service's request -> its response
    definition/GATEWAY/TYPE/MD5                   query: a type's full definition
    param/NAME/GATEWAY                            query: name -> value of a parameter
    ping/GATEWAY, status/GATEWAY                  query: the gateway's clock; its counters

Tokens are Zenoh's liveliness tokens: they disappear with the session that declared them. Slashes in names and types are
written as ``%``. Keys in any other format are ignored: parsers return None for them.
"""

from __future__ import annotations

import re
import struct
from typing import NamedTuple

from minirospy.base.names import is_legal_name

__all__ = [
    "ROOT",
    "UNKNOWN_MD5",
    "Claim",
    "Offer",
    "ServiceToken",
    "Stamp",
    "TopicToken",
    "Want",
    "call_key",
    "claim_key",
    "definition_key",
    "in_key",
    "is_global_name",
    "is_machine",
    "is_md5",
    "is_robot_name",
    "mangled",
    "offer_key",
    "out_key",
    "parse_call",
    "parse_claim",
    "parse_definition",
    "parse_in",
    "parse_offer",
    "parse_service",
    "parse_stamp",
    "parse_topic",
    "parse_want",
    "replay_key",
    "serialize_stamp",
    "service_key",
    "topic_key",
    "unmangled",
    "want_key",
]

ROOT = "@minirospy/1"
"""The first chunk starts with ``@``, so that ``**`` does not match it; the second is the version of this key scheme."""

UNKNOWN_MD5 = "-"
"""An unknown md5sum: the topic has no publishers, and its type is not installed."""

_MAX_NAME = 256
_ROBOT = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}", re.ASCII)
_GATEWAY = re.compile(r"[0-9a-f]{16}")
_TYPE = re.compile(r"[A-Za-z]\w{0,127}%[A-Za-z]\w{0,127}", re.ASCII)
_MD5 = re.compile(r"[0-9a-f]{32}")
_START = re.compile(r"[0-9a-f]{1,16}")
_FLAGS = re.compile(r"[pslf]{1,4}|-")
_STAMP = struct.Struct("<Iq")


class Claim(NamedTuple):
    """A gateway's claim to represent a robot. ``start`` is in ns of the gateway's clock; ``host`` is its machine.

    Neither ``start`` nor ``host`` is verified; ``start`` is only compared between claims from the same machine.
    """

    name: str
    gateway: str
    start: int
    host: str


class TopicToken(NamedTuple):
    """A robot's topic. If ``has_frames`` is true, the robot's name is prefixed to the frame ids in its messages."""

    robot: str
    gateway: str
    topic: str
    type: str
    md5sum: str
    is_published: bool
    is_subscribed: bool
    is_latched: bool = False
    has_frames: bool = False

    def has_same_messages(self, other: TopicToken) -> bool:
        """Return whether both tokens announce the same published messages; the tokens may differ in subscribers and latching."""
        ends = other._replace(is_subscribed=self.is_subscribed, is_latched=self.is_latched)
        return self.is_published and ends == self


class ServiceToken(NamedTuple):
    """A robot's service."""

    robot: str
    gateway: str
    service: str
    type: str
    md5sum: str


class Want(NamedTuple):
    """A request for a topic by another gateway (the reader) whose local nodes subscribe to it."""

    topic: str
    reader: str


class Offer(NamedTuple):
    """An offer of messages for a topic by another gateway (the writer) whose local nodes publish it."""

    topic: str
    writer: str
    type: str
    md5sum: str
    is_latched: bool


class Stamp(NamedTuple):
    """A message's attachment: its sequence number on the topic, and its send time in ns of the sender's clock."""

    number: int
    nanoseconds: int


def is_robot_name(name: str) -> bool:
    """Return whether a name is valid for a robot. Robot names become ROS namespaces."""
    return bool(_ROBOT.fullmatch(name))


def is_machine(value: object) -> bool:
    """Return whether a value is a valid machine id, which is the last part of a robot's token."""
    return isinstance(value, str) and bool(_GATEWAY.fullmatch(value))


def is_md5(text: str) -> bool:
    """Return whether a string has the form of an md5sum."""
    return bool(_MD5.fullmatch(text))


def mangled(name: str) -> str:
    """Convert a name or type to a single key chunk: ``/arm/state`` becomes ``%arm%state``."""
    return name.replace("/", "%")


def unmangled(chunk: str) -> str | None:
    """Convert a key chunk to a global graph resource name, or to None if the chunk is invalid."""
    name = chunk.replace("%", "/")
    return name if is_global_name(name) else None


def is_global_name(name: str) -> bool:
    """Return whether a string is a global graph resource name and not too long."""
    return (
        len(name) <= _MAX_NAME
        and name.startswith("/")
        and not name.endswith("/")
        and "//" not in name
        and is_legal_name(name)
    )


# --- tokens


def claim_key(claim: Claim, kind: str = "robot") -> str:
    """Return the key of a robot's token. If ``kind`` is "control", the token is a control room's, whose name may be ``-``."""
    return f"{ROOT}/{kind}/{claim.name}/{claim.gateway}/{claim.start:x}/{claim.host}"


def parse_claim(key: str, kind: str = "robot") -> Claim | None:
    """Parse the key of a robot's or a control room's token."""
    match _chunks(key, kind):
        case [name, gateway, start, host]:
            if not is_robot_name(name) and not (kind == "control" and name == "-"):
                return None
            if _GATEWAY.fullmatch(gateway) and _START.fullmatch(start) and _GATEWAY.fullmatch(host):
                return Claim(name, gateway, int(start, 16), host)
    return None


def topic_key(token: TopicToken) -> str:
    """Return the key of a topic's token."""
    flags = "".join(
        letter
        for letter, is_set in (
            ("p", token.is_published),
            ("s", token.is_subscribed),
            ("l", token.is_latched),
            ("f", token.has_frames),
        )
        if is_set
    )
    return f"{ROOT}/topic/{token.robot}/{token.gateway}/{mangled(token.topic)}/{mangled(token.type)}/{token.md5sum}/{flags}"


def parse_topic(key: str) -> TopicToken | None:
    """Parse the key of a topic's token."""
    match _chunks(key, "topic"):
        case [robot, gateway, topic, type_, md5sum, flags]:
            name = unmangled(topic)
            if name is None or not _are_ends(robot, gateway) or not _is_type(type_, md5sum):
                return None
            if not _FLAGS.fullmatch(flags) or not {"p", "s"} & set(flags):
                return None
            if "p" in flags and md5sum == UNKNOWN_MD5:
                return None
            return TopicToken(
                robot,
                gateway,
                name,
                type_.replace("%", "/"),
                md5sum,
                "p" in flags,
                "s" in flags,
                "l" in flags,
                "f" in flags,
            )
    return None


def service_key(token: ServiceToken) -> str:
    """Return the key of a service's token."""
    type_ = mangled(token.type)
    return f"{ROOT}/service/{token.robot}/{token.gateway}/{mangled(token.service)}/{type_}/{token.md5sum}"


def parse_service(key: str) -> ServiceToken | None:
    """Parse the key of a service's token."""
    match _chunks(key, "service"):
        case [robot, gateway, service, type_, md5sum]:
            name = unmangled(service)
            if name is None or not _are_ends(robot, gateway):
                return None
            if _is_type(type_, md5sum) and md5sum != UNKNOWN_MD5:
                return ServiceToken(robot, gateway, name, type_.replace("%", "/"), md5sum)
    return None


def want_key(robot: str, gateway: str, want: Want) -> str:
    """Return the key of the token with which a gateway requests a topic from a robot."""
    return f"{ROOT}/want/{robot}/{gateway}/{mangled(want.topic)}/{want.reader}"


def parse_want(key: str) -> Want | None:
    """Parse the key of a token with which a gateway requests a topic."""
    match _chunks(key, "want"):
        case [_, _, topic, reader]:
            name = unmangled(topic)
            if name is not None and _GATEWAY.fullmatch(reader):
                return Want(name, reader)
    return None


def offer_key(robot: str, gateway: str, offer: Offer) -> str:
    """Return the key of the token with which a gateway offers a robot messages for a topic."""
    flags = "l" if offer.is_latched else "-"
    type_ = mangled(offer.type)
    return (
        f"{ROOT}/offer/{robot}/{gateway}/{mangled(offer.topic)}/{offer.writer}/{type_}/{offer.md5sum}/{flags}"
    )


def parse_offer(key: str) -> Offer | None:
    """Parse the key of a token with which a gateway offers messages for a topic."""
    match _chunks(key, "offer"):
        case [_, _, topic, writer, type_, md5sum, flags]:
            name = unmangled(topic)
            if name is None or not _GATEWAY.fullmatch(writer) or not _FLAGS.fullmatch(flags):
                return None
            if _is_type(type_, md5sum) and md5sum != UNKNOWN_MD5:
                return Offer(name, writer, type_.replace("%", "/"), md5sum, "l" in flags)
    return None


# --- messages and queries


def out_key(robot: str, gateway: str, md5sum: str, topic: str) -> str:
    """Return the key on which a robot publishes a topic's messages."""
    return f"{ROOT}/out/{robot}/{gateway}/{md5sum}/{mangled(topic)}"


def replay_key(robot: str, gateway: str, md5sum: str, topic: str, reader: str) -> str:
    """Return the key on which a topic's latched messages are replayed to one reader."""
    return f"{ROOT}/replay/{robot}/{gateway}/{md5sum}/{mangled(topic)}/{reader}"


def in_key(robot: str, gateway: str, md5sum: str, topic: str, writer: str) -> str:
    """Return the key on which a writer sends a topic's messages to a robot."""
    return f"{ROOT}/in/{robot}/{gateway}/{md5sum}/{mangled(topic)}/{writer}"


def parse_in(key: str) -> tuple[str, str, str] | None:
    """Parse the key of a message to a robot; return its topic, md5sum and writer."""
    match _chunks(key, "in"):
        case [_, _, md5sum, topic, writer]:
            name = unmangled(topic)
            if name is not None and _MD5.fullmatch(md5sum) and _GATEWAY.fullmatch(writer):
                return name, md5sum, writer
    return None


def call_key(robot: str, gateway: str, service: str, md5sum: str) -> str:
    """Return the key on which a service is called."""
    return f"{ROOT}/call/{robot}/{gateway}/{mangled(service)}/{md5sum}"


def parse_call(key: str) -> tuple[str, str] | None:
    """Parse the key of a service call; return its service and md5sum."""
    match _chunks(key, "call"):
        case [_, _, service, md5sum]:
            name = unmangled(service)
            if name is not None and _MD5.fullmatch(md5sum):
                return name, md5sum
    return None


def definition_key(gateway: str, type_: str, md5sum: str) -> str:
    """Return the key on which a type's full definition is queried."""
    return f"{ROOT}/definition/{gateway}/{mangled(type_)}/{md5sum}"


def parse_definition(key: str) -> tuple[str, str] | None:
    """Parse the key of a query for a full definition; return its type and md5sum."""
    match _chunks(key, "definition"):
        case [_, type_, md5sum]:
            if _is_type(type_, md5sum) and md5sum != UNKNOWN_MD5:
                return type_.replace("%", "/"), md5sum
    return None


def serialize_stamp(stamp: Stamp) -> bytes:
    """Serialize a message's attachment."""
    return _STAMP.pack(stamp.number & 0xFFFFFFFF, stamp.nanoseconds)


def parse_stamp(data: bytes) -> Stamp | None:
    """Parse a message's attachment, or return None if it is not from a minirospy gateway."""
    return Stamp._make(_STAMP.unpack(data)) if len(data) == _STAMP.size else None


def _chunks(key: str, kind: str) -> list[str]:
    """Return the chunks that follow the kind in a key, or an empty list if the key's kind is different."""
    start = f"{ROOT}/{kind}/"
    return key[len(start) :].split("/") if key.startswith(start) else []


def _are_ends(robot: str, gateway: str) -> bool:
    return is_robot_name(robot) and _GATEWAY.fullmatch(gateway) is not None


def _is_type(type_: str, md5sum: str) -> bool:
    return _TYPE.fullmatch(type_) is not None and (md5sum == UNKNOWN_MD5 or bool(_MD5.fullmatch(md5sum)))
