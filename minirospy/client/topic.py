"""Common parts of publishers and subscribers: the topic, its message class, and the registration.

Source: http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection
from typing import Any, Generic, TypeVar

from minirospy.base.errors import MasterUnreachableError, ROSException, RpcError, RpcRefused
from minirospy.base.notes import noted
from minirospy.client.connection import Connection
from minirospy.client.identity import warn_of_illegal_name
from minirospy.client.session import Session, current_session
from minirospy.client.type_advice import advice_for_message_class
from minirospy.core.idl import protocols
from minirospy.core.idl.message import Message
from minirospy.core.wire.tcpros import ANY

__all__ = ["AnyMsg", "SharedTopic", "Topic", "register_with_master", "unregister_from_master"]

_log = logging.getLogger("rosout")
_M_co = TypeVar("_M_co", bound=protocols.Message, covariant=True)


class AnyMsg(Message):
    """A message of any type: its bytes, and the publisher's connection header in ``_connection_header``."""

    _md5sum = ANY
    _type = ANY
    _has_header = False
    _takes_memoryview = True
    _full_text = ""
    _slot_types: list[str] = []
    __slots__ = ["_buff"]

    def __init__(self, *args: object) -> None:
        if args:
            raise ROSException("AnyMsg does not accept arguments")
        self._buff: bytes | None = None

    def serialize(self, buff: protocols.Writer) -> None:
        """Write the message's bytes."""
        if self._buff is None:
            raise ROSException("AnyMsg is not initialized")
        buff.write(self._buff)

    def deserialize(self, str: protocols.Buffer) -> AnyMsg:
        """Store the bytes."""
        self._buff = bytes(str)
        return self


class Topic(Generic[_M_co]):
    """Base class of Publisher and Subscriber, with ``name`` (resolved), ``type``, ``md5sum`` and ``data_class``.

    ``impl`` is shared by all of the topic's handles in this process. It is None once unregistered.
    """

    impl: SharedTopic | None

    def __init__(self, name: str, data_class: type[_M_co], reg_type: str) -> None:
        if not name or not isinstance(name, str):
            error = ValueError("topic name is not a non-empty string")
            raise noted(error, "the first argument is the topic's name, the second one its type")
        if data_class is None:
            error = ValueError("topic parameter 'data_class' is not initialized")
            raise noted(error, "the second argument is the type, as std_msgs.msg.String")
        if not isinstance(data_class, type):
            error = ValueError(f"data_class [{data_class}] is not a class")
            raise noted(error, advice_for_message_class(data_class))
        if not hasattr(data_class, "_md5sum") or not hasattr(data_class, "serialize"):
            error = ValueError(f"data_class [{type(data_class).__name__}] is not a message data class")
            raise noted(error, advice_for_message_class(data_class))
        self._session = current_session()
        self.resolved_name = self._session.identity.resolve_topic(name)
        warn_of_illegal_name(name, stacklevel=4)
        self.name = self.resolved_name
        self.data_class = data_class
        self.type: str = data_class._type
        self.md5sum: str = data_class._md5sum
        self.reg_type = reg_type

    def get_num_connections(self) -> int:
        """Return the number of connected nodes: a Publisher's subscribers, or a Subscriber's publishers."""
        return self.impl.get_num_connections() if self.impl else 0

    def unregister(self) -> None:
        """Unregister. Unregistering the topic's last handle in this process also closes the connections. Idempotent.

        As in rospy, only ``name`` remains usable.
        """
        with self._session.lock:
            shared, self.impl = self.impl, None
        if shared:
            shared.leave(self)
            self.resolved_name = self.type = self.md5sum = self.data_class = None  # type: ignore[assignment]


class SharedTopic:
    """The object that a topic's handles in this process share: rospy's ``impl``, which user code reads."""

    _handles: Collection[Topic[Any]]

    def __init__(self, session: Session, topic: str, data_class: type[protocols.Message]) -> None:
        self._session = session
        self.resolved_name = self.name = topic
        self.data_class = data_class
        self.type: str = data_class._type

    @property
    def ref_count(self) -> int:
        """The number of handles that share this object."""
        return len(self._handles)

    @property
    def closed(self) -> bool:
        """True if the last handle was unregistered."""
        return not self._handles

    @property
    def connections(self) -> list[Connection]:
        """The links to the other nodes, as rospy represents them."""
        raise NotImplementedError

    def get_stats_info(self) -> list[tuple[object, ...]]:
        """Return the topic's rows for the Slave API's getBusInfo."""
        name = self.resolved_name
        return [
            (c.id, c.endpoint_id, c.direction, c.transport_type, name, True, c.get_transport_info())
            for c in self.connections
        ]

    def leave(self, handle: Any) -> None:
        """Release one handle. Unregister the topic when the last handle is released."""
        raise NotImplementedError

    def get_num_connections(self) -> int:
        """Return the number of links."""
        raise NotImplementedError

    def has_connections(self) -> bool:
        """Return whether there are any links."""
        return bool(self.get_num_connections())

    def has_connection(self, endpoint_id: str) -> bool:
        """Return whether there is a link to a node. ``endpoint_id`` is a subscriber's name, or a publisher's URI."""
        raise NotImplementedError


def register_with_master(what: str, topic: str, wait: Callable[[], object]) -> None:
    """Wait for a registration to finish. If the master refuses it, only log the refusal, as rospy does."""
    try:
        wait()
    except MasterUnreachableError as error:
        _log.critical("unable to register %s [%s] with master: %s. Will keep trying.", what, topic, error)
    except RpcError as error:
        why = error.text if isinstance(error, RpcRefused) else error
        _log.critical("unable to register %s [%s] with master: %s", what, topic, why)


def unregister_from_master(wait: Callable[[], object]) -> None:
    """Wait for an unregistration to finish.

    If the master does not respond, the unregistration is sent later, unless the master has lost the registration.
    """
    try:
        wait()
    except (MasterUnreachableError, RpcError) as error:
        _log.debug("unregistering: %s", error)
