"""TCPROS roles: the header that each node sends, and the check of the peer's header.

Pure decisions on fields; the sockets are in ``minirospy.runtime``.
Source: http://wiki.ros.org/ROS/TCPROS, http://wiki.ros.org/ROS/Connection%20Header.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from minirospy.base.errors import HandshakeRefused, WireError
from minirospy.base.escape import escaped, has_controls
from minirospy.core.wire.header import Header

__all__ = [
    "ANY",
    "LARGE_MESSAGES",
    "InterfaceType",
    "check_publisher",
    "check_service",
    "check_service_client",
    "check_subscriber",
    "publisher_header",
    "service_client_header",
    "service_header",
    "subscriber_header",
]

_NOT_A_NAME = "field [callerid] contains illegal chars"

# The version of split frames and of the ring's announcements. A subscriber that declares another one receives normal frames.
LARGE_MESSAGES = "2"

ANY = "*"  # type and md5sum sent by a peer that accepts any type


class InterfaceType(NamedTuple):
    """A message or service type in a connection header: name (``pkg/Name``), md5sum, full text."""

    name: str
    md5sum: str
    definition: str = ""

    @classmethod
    def of(cls, described: Any) -> InterfaceType:
        """Return the InterfaceType of a message or service class. For a service, ``definition`` is empty."""
        return cls(described._type, described._md5sum, getattr(described, "_full_text", ""))


def subscriber_header(
    topic: str,
    type_: InterfaceType,
    caller_id: str,
    *,
    tcp_nodelay: bool = False,
    split_frames: bool = False,
    shared_memory: bool = False,
) -> Header:
    """Return the header that a subscriber sends first.

    ``split_frames``: the subscriber supports split frames (``core/wire/framing``). ``shared_memory``: it can read from a ring
    (``core/wire/ring``).
    """
    return {
        **({"shared_memory": LARGE_MESSAGES} if shared_memory else {}),
        **({"split_frames": LARGE_MESSAGES} if split_frames else {}),
        "callerid": caller_id,
        "md5sum": type_.md5sum,
        "message_definition": type_.definition,
        "tcp_nodelay": "1" if tcp_nodelay else "0",
        "topic": topic,
        "type": type_.name,
    }


def publisher_header(
    topic: str, type_: InterfaceType, caller_id: str, *, latch: bool, extra: Mapping[str, str] | None = None
) -> Header:
    """Return a publisher's reply header; ``extra`` are the user's fields.

    As in rospy, the user's fields override others: for example, a relay of AnyMsg sends the type of the relayed messages.
    """
    return {
        "callerid": caller_id,
        "latching": "1" if latch else "0",
        "md5sum": type_.md5sum,
        "message_definition": type_.definition,
        "topic": topic,
        "type": type_.name,
        **{name: str(value) for name, value in (extra or {}).items()},
    }


def check_subscriber(fields: Header, topic: str, type_: InterfaceType) -> str | None:
    """Return why a publisher of ``type_`` refuses a subscriber that sent these fields, or None if the subscriber is accepted."""
    for name in ("md5sum", "callerid"):
        if name not in fields:
            return f"Missing required '{name}' field"
    theirs, their_type = fields["md5sum"], fields.get("type", ANY)
    if has_controls(fields["callerid"]):
        return _NOT_A_NAME
    if _fits(theirs, type_):
        return None
    if their_type not in (ANY, type_.name):
        return f"topic types do not match: [{their_type}] vs. [{type_.name}]"
    return (
        f"Client [{fields['callerid']}] wants topic [{topic}] to have datatype/md5sum [{their_type}/{theirs}], "
        f"but our version has [{type_.name}/{type_.md5sum}] Dropping connection."
    )


def check_publisher(fields: Header, topic: str, type_: InterfaceType) -> None:
    """Raise HandshakeRefused unless a publisher's reply matches ``type_``."""
    _raise_error_field(fields)
    for name in ("md5sum", "type"):
        if name not in fields:
            raise HandshakeRefused(f"publisher of [{topic}] sent a connection header without [{name}]")
    theirs, their_type = escaped(fields["md5sum"]), escaped(fields["type"])
    if _fits(theirs, type_):
        return
    if their_type not in (ANY, type_.name):
        raise HandshakeRefused(f"topic types do not match: [{their_type}] vs. [{type_.name}]")
    raise HandshakeRefused(
        f"topic [{topic}]: md5sums do not match: [{theirs}] vs. [{type_.md5sum}]: "
        f"the definitions of [{type_.name}] differ, build both sides from the same one"
    )


def service_client_header(
    service: str,
    md5sum: str,
    caller_id: str,
    *,
    persistent: bool = False,
    probe: bool = False,
    extra: Mapping[str, str] | None = None,
) -> Header:
    """Return the header that a service client sends first. With ``probe``, the client only tests whether the service is alive."""
    fields = {"callerid": caller_id, "md5sum": md5sum, "service": service}
    if persistent:
        fields["persistent"] = "1"
    if probe:
        fields["probe"] = "1"
    # As in rospy, the user's fields override the others.
    return {**fields, **{name: str(value) for name, value in (extra or {}).items()}}


def service_header(
    service: str, type_: InterfaceType, caller_id: str, request_type: str, response_type: str
) -> Header:
    """Return a service's reply header: rospy's fields, and roscpp's request and response types."""
    return {
        "callerid": caller_id,
        "md5sum": type_.md5sum,
        "request_type": request_type,
        "response_type": response_type,
        "service": service,
        "type": type_.name,
    }


def check_service_client(fields: Header, type_: InterfaceType) -> str | None:
    """Return why a service of ``type_`` refuses a client that sent these fields, or None if the client is accepted."""
    for name in ("service", "md5sum", "callerid"):
        if name not in fields:
            return f"Missing required '{name}' field"
    if has_controls(fields["callerid"]):
        return _NOT_A_NAME
    if fields["md5sum"] not in (ANY, type_.md5sum):
        return (
            f"request from [{fields['callerid']}]: md5sums do not match: "
            f"[{fields['md5sum']}] vs. [{type_.md5sum}]"
        )
    return None


def check_service(fields: Header) -> None:
    """Raise HandshakeRefused if a service replied with an error, WireError if there is no md5sum."""
    _raise_error_field(fields)
    if "md5sum" not in fields:
        raise WireError("header missing required field [md5sum]")


def _raise_error_field(fields: Header) -> None:
    if "error" in fields:
        raise HandshakeRefused(escaped(fields["error"], "\n"))


def _fits(md5sum: str, type_: InterfaceType) -> bool:
    """Return whether the md5sum matches the type.

    The names may differ, because a renamed type with the same fields is compatible.
    """
    return md5sum == type_.md5sum or ANY in (md5sum, type_.md5sum)
