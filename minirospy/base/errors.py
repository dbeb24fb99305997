"""Every error that minirospy raises on purpose.

::

    Exception
    +-- MinirospyError                  an error with a one-line explanation for the user in str()
    |   +-- UsageError                  usage error of a command (exit status 2)
    |   +-- NotFoundError               a package, node, type, topic or file that does not exist (with similar names)
    |   +-- MasterUnreachableError      no master responds at the URI
    |   +-- NodeUnreachableError        a node that is registered with the master does not respond
    |   +-- RpcError                    a remote procedure call (XML-RPC) failed
    |   |   +-- RpcFault                the peer responded with an XML-RPC fault
    |   |   +-- RpcRefused              the peer responded with a status code other than 1
    |   |   +-- RpcProtocolError        the peer's bytes are not HTTP or not XML-RPC
    |   |   +-- RpcUnreachable          the peer could not be reached, or did not respond in time
    |   +-- WireError                   bytes that are not TCPROS
    |   |   +-- HandshakeRefused        the peer replied to a connection header with ``error=``
    |   |   +-- CallFailed              the service responded to a call with an error
    |   +-- SourceError                 a fault in a text written by a person (file, line)
    |   |   +-- DefinitionError         a .msg, .srv or .action text that cannot be parsed
    |   |   +-- ManifestError           a package.xml that cannot be read
    |   |   +-- BuildError              a workspace or package that cannot be built
    |   |   +-- LaunchError             a launch file that cannot be loaded
    |   |   +-- UrdfError               a robot description that cannot be read
    |   |   +-- SdfError                a simulated world or model that cannot be read
    |   |   +-- RvizFileError           a .rviz file that cannot be read or written
    |   +-- BagError                    a bag that cannot be read or written
    |   |   +-- BagFormatError          bytes that violate the bag format
    |   |   +-- BagVersionError         a format version that cannot be read
    |   |   +-- BagUnindexedError       a bag without its index: it was not closed, or its end is missing
    |   |   |   `-- McapUnindexedError  an MCAP file without its summary, for the same reasons
    |   |   +-- BagEncryptedError       the bag is encrypted
    |   |   +-- BagCompressionError     an unknown compression, or its library is missing
    |   +-- BoardError                  the virtual board cannot be reached
    |   +-- BridgeError                 the bridge to browsers cannot be started, or refuses a request
    |   |   +-- BridgeProtocolError     a client's message that does not conform to its protocol
    |   +-- ValueTextError              a typed value that is not YAML, or does not fit its target
    +-- ROSException                    rospy's tree (http://wiki.ros.org/rospy/Overview/Exceptions)
    |   +-- ROSInitException
    |   +-- ThreadLimitError            the system allows this process no more threads
    |   +-- ROSSerializationException
    |   +-- ROSInterruptException
    |   |   +-- ROSTimeMovedBackwardsException
    |   +-- ROSInternalException
    |       +-- TransportException
    |           +-- TransportInitError
    |           +-- TransportTerminated
    +-- ServiceException                a service call failed, at the client or the server
    +-- TransformException              tf2's tree (http://wiki.ros.org/tf2/Errors)
    |   +-- ConnectivityException       the two frames are in different trees
    |   +-- LookupException             an unknown frame, or a loop of transforms
    |   +-- ExtrapolationException      a time without data
    |   +-- InvalidArgumentException    a frame name that is empty or starts with a slash
    |   +-- TimeoutException            a buffer server that does not respond
    +-- MessageException                genpy's tree: values and bytes that do not match a message
        +-- SerializationError
        +-- DeserializationError
"""

from __future__ import annotations

from collections.abc import Iterable

from minirospy.base.suggestions import nearest

__all__ = [
    "SUSPENDED",
    "BagCompressionError",
    "BagEncryptedError",
    "BagError",
    "BagFormatError",
    "BagUnindexedError",
    "BagVersionError",
    "BoardError",
    "BridgeError",
    "BridgeProtocolError",
    "BuildError",
    "CallFailed",
    "ConnectivityException",
    "DefinitionError",
    "DeserializationError",
    "ExtrapolationException",
    "HandshakeRefused",
    "InvalidArgumentException",
    "LaunchError",
    "LookupException",
    "ManifestError",
    "MasterUnreachableError",
    "McapUnindexedError",
    "MessageException",
    "MinirospyError",
    "NoThreadsAtEndError",
    "NodeUnreachableError",
    "NotFoundError",
    "ROSException",
    "ROSInitException",
    "ROSInternalException",
    "ROSInterruptException",
    "ROSSerializationException",
    "ROSTimeMovedBackwardsException",
    "RpcError",
    "RpcFault",
    "RpcProtocolError",
    "RpcRefused",
    "RpcTimeout",
    "RpcUnreachable",
    "RvizFileError",
    "SdfError",
    "SerializationError",
    "ServiceException",
    "SourceError",
    "ThreadLimitError",
    "TimeoutException",
    "TransformException",
    "TransportException",
    "TransportInitError",
    "TransportTerminated",
    "UrdfError",
    "UsageError",
    "ValueTextError",
    "WireError",
]


class MinirospyError(Exception):
    """The base class of minirospy's own errors; ``str()`` is one line for the user."""


class UsageError(MinirospyError):
    """A command was called with wrong arguments."""


class NotFoundError(MinirospyError):
    """A named object does not exist; the message suggests similar names that do.

    ``kind`` is the kind of object that was looked up ("package", "message type"), ``name`` the given name,
    ``known`` every name that exists, ``hint`` an instruction for the user.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str] = (), hint: str = "") -> None:
        super().__init__(kind, name)
        self.kind = kind
        self.name = name
        self.hint = hint
        self.nearest = nearest(name, known)

    def __str__(self) -> str:
        text = f"{self.kind} [{self.name}] not found"
        if self.nearest:
            text += f"; did you mean {' or '.join(self.nearest)}?"
        if self.hint:
            text += f" ({self.hint})" if self.nearest else f": {self.hint}"
        return text


class MasterUnreachableError(MinirospyError):
    """No master responds at ``uri``.

    ``why``: why this process cannot call the master; ``cause``: why the master does not respond. ``ros_text`` is ROS's
    message for this error.
    """

    ros_text = "Unable to communicate with master!"

    def __init__(self, uri: str, why: str = "", cause: str = "") -> None:
        super().__init__(uri, why, cause)
        self.uri = uri
        self.why = why
        self.cause = cause

    def __str__(self) -> str:
        if self.why:
            return f"the master at {self.uri} cannot be called: {self.why}"
        if self.cause:
            return f"no ROS master answers at {self.uri}: {self.cause}"
        return (
            f"no ROS master answers at {self.uri}: start one with `roscore`, "
            "or set ROS_MASTER_URI to the machine where it runs"
        )


class NodeUnreachableError(MinirospyError):
    """The node or service ``name``, registered at ``uri``, does not respond. ``kind`` is "node" or "service"."""

    def __init__(self, name: str, uri: str, why: str = "", kind: str = "node") -> None:
        super().__init__(name, uri, why, kind)
        self.name = name
        self.uri = uri
        self.why = why
        self.kind = kind

    def __str__(self) -> str:
        why = f" ({self.why})" if self.why else ""
        return (
            f"{self.kind} [{self.name}] does not answer at {self.uri}{why}: "
            "`rosnode cleanup` forgets nodes that have ended, `minirospy doctor` says what else is wrong"
        )


SUSPENDED = (
    "it takes connections, so it is busy, or suspended: after Ctrl-Z, `fg` in its terminal continues it"
)
"""The explanation for a process that accepts connections but does not respond."""


class RpcError(MinirospyError):
    """A remote procedure call failed."""


class RpcFault(RpcError):
    """The peer responded with an XML-RPC fault."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(code, text)
        self.code = code
        self.text = text

    def __str__(self) -> str:
        return f"XML-RPC fault {self.code}: {self.text}"


class RpcRefused(RpcError):
    """The response to a ROS API call has a status ``code`` other than 1 (0 failure, -1 error)."""

    def __init__(self, method: str, code: int, text: str) -> None:
        super().__init__(method, code, text)
        self.method = method
        self.code = code
        self.text = text

    def __str__(self) -> str:
        return f"{self.method}: {self.text}"


class RpcProtocolError(RpcError):
    """A peer sent data that is not valid HTTP or XML-RPC. ``status`` is the HTTP status of a server's response."""

    def __init__(self, text: str, *, status: int = 400) -> None:
        super().__init__(text)
        self.status = status


class RpcUnreachable(RpcError):
    """The peer at ``uri`` could not be reached or did not respond in time."""

    def __init__(self, uri: str, why: str) -> None:
        super().__init__(uri, why)
        self.uri = uri
        self.why = why

    def __str__(self) -> str:
        return f"no answer from {self.uri}: {self.why}"


class RpcTimeout(RpcUnreachable):
    """The peer accepted the connection but did not respond in time: its process is suspended or busy."""

    def __init__(self, uri: str, seconds: float) -> None:
        super().__init__(uri, f"timed out after {seconds:g} s")
        self.seconds = seconds

    def __reduce__(self) -> tuple[type[RpcTimeout], tuple[str, float]]:
        return RpcTimeout, (self.uri, self.seconds)


class WireError(MinirospyError):
    """The bytes are not TCPROS."""


class HandshakeRefused(WireError):
    """The peer replied to a connection header with an error, ``error=text``."""


class CallFailed(WireError):
    """The service responded to a call with an error; ``text`` is in the server's encoding."""

    def __init__(self, text: bytes) -> None:
        super().__init__(text)
        self.text = text

    def __str__(self) -> str:
        return self.text.decode("utf-8", "replace")


class SourceError(MinirospyError):
    """An error in text that a user wrote, at ``line`` (1-based; 0: the whole text); ``file`` is the text's path or name."""

    def __init__(self, file: str, line: int, text: str) -> None:
        super().__init__(file, line, text)
        self.file = file
        self.line = line
        self.text = text

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.text}" if self.line else f"{self.file}: {self.text}"


class DefinitionError(SourceError):
    """An interface definition cannot be parsed. If the definition is not in a file, ``file`` is the name of its type."""


class ManifestError(SourceError):
    """A package.xml cannot be read."""


class BuildError(SourceError):
    """A workspace or a package cannot be built."""


class LaunchError(SourceError):
    """A launch file cannot be loaded."""


class RvizFileError(SourceError):
    """A .rviz file cannot be read or written."""


class UrdfError(SourceError):
    """A robot description cannot be read. ``context``: the enclosing elements as ROS's parser describes them, innermost first."""

    def __init__(self, file: str, line: int, text: str, context: tuple[str, ...] = ()) -> None:
        super().__init__(file, line, ": ".join((text, *context[:1])))
        self.trail = (text, *context)


class SdfError(SourceError):
    """A simulated world or model (SDF) cannot be read."""


class BagError(MinirospyError):
    """A bag cannot be read or written. ``str()`` does not contain the file name, which the caller knows."""


class BagFormatError(BagError):
    """The bytes at ``position`` (None: the whole file) violate the bag format."""

    def __init__(self, why: str, position: int | None = None) -> None:
        super().__init__(why, position)
        self.why = why
        self.position = position

    def __str__(self) -> str:
        return self.why if self.position is None else f"{self.why} (at byte {self.position})"


class NoBagError(BagFormatError):
    """The file does not start with a bag's first line."""


class BagVersionError(BagError):
    """A bag of this ``version`` (101 is 1.1) cannot be read, or not for this purpose."""

    def __init__(self, version: int, why: str) -> None:
        super().__init__(version, why)
        self.version = version
        self.why = why

    def __str__(self) -> str:
        return self.why


class BagUnindexedError(BagError):
    """The bag was not closed, or its index is damaged; ``why`` describes the fault, if one was found."""

    def __init__(self, why: str = "") -> None:
        super().__init__(why)
        self.why = why

    def __str__(self) -> str:
        return "Unindexed bag"


class McapUnindexedError(BagUnindexedError):
    """The MCAP file was not completed, or its summary is damaged; ``why`` describes the fault."""

    def __str__(self) -> str:
        return f"the MCAP file is not complete: {self.why}"


class BagEncryptedError(BagError):
    """The bag is encrypted by ``encryptor``, a rosbag plugin that is not supported."""

    def __init__(self, encryptor: str) -> None:
        super().__init__(encryptor)
        self.encryptor = encryptor

    def __str__(self) -> str:
        return (
            f"the bag is encrypted by [{self.encryptor}], which is not supported: "
            "decrypt it by `rosbag decrypt` of ROS where its key is installed"
        )


class BagCompressionError(BagError):
    """Chunks with this ``compression`` cannot be read or written; ``why`` is the reason."""

    def __init__(self, compression: str, why: str = "") -> None:
        super().__init__(compression, why)
        self.compression = compression
        self.why = why

    def __str__(self) -> str:
        text = f"unsupported compression type: {self.compression}"
        return f"{text} ({self.why})" if self.why else text


class BoardError(MinirospyError):
    """The virtual board cannot be reached, or refused a request."""


class BridgeError(MinirospyError):
    """The bridge to browsers cannot be started, or refuses a client's request."""


class BridgeProtocolError(BridgeError):
    """A client's message does not conform to its protocol."""


class ValueTextError(MinirospyError):
    """A value typed by a user cannot be used.

    ``text`` is the value, or the name of its file or parameter; ``why`` is the reason.
    """

    def __init__(self, text: str, why: str) -> None:
        super().__init__(text, why)
        self.text = text
        self.why = why

    def __str__(self) -> str:
        shown = " ".join(self.text.split())
        return f"'{shown if len(shown) <= 60 else shown[:57] + '...'}': {self.why}"


class ROSException(Exception):
    """The base class of rospy's errors."""


class ROSInitException(ROSException):
    """A node could not be initialized."""


class ThreadLimitError(ROSException):
    """The system allows this process no more threads; ``limits`` are the known limits."""

    def __init__(self, threads: int, limits: list[str]) -> None:
        super().__init__(threads, limits)
        self.threads = threads
        self.limits = limits

    def __str__(self) -> str:
        known = f" (limits: {', '.join(self.limits)})" if self.limits else ""
        return (
            f"the system starts no more threads for this process, which has {self.threads}{known}: raise the limit, or "
            "use fewer subscribers, services and timers in one process"
        )


class NoThreadsAtEndError(ThreadLimitError):
    """A thread cannot be started after the main thread has exited.

    Python 3.12.0 to 3.12.2 start none after the main thread has exited (CPython issue 113964).
    """

    def __init__(self) -> None:
        super().__init__(0, [])

    def __str__(self) -> str:
        return (
            "Python 3.12.0 to 3.12.2 start no more threads once the main thread has ended, which nodes need until their "
            "end: use 3.12.3 or later"
        )


class ROSSerializationException(ROSException):
    """A message could not be serialized or deserialized."""


class ROSInterruptException(ROSException):
    """The node's shutdown interrupted a blocking call. rospy's exception is a subclass in `minirospy.client.lifecycle`."""


class ROSTimeMovedBackwardsException(ROSInterruptException):
    """Simulated time jumped back during a sleep; it is now ``time`` seconds before the sleep's start."""

    def __init__(self, time: float) -> None:
        super().__init__("ROS time moved backwards")
        self.time = time


class ROSInternalException(ROSException):
    """A fault inside the client library."""


class TransportException(ROSInternalException):
    """A connection to a peer failed."""


class TransportInitError(TransportException):
    """A connection to a peer could not be set up."""


class TransportTerminated(TransportException):
    """A connection to a peer was closed."""


class ServiceException(Exception):
    """A service call failed: there is no provider, the connection broke, or the handler raised an error."""


class TransformException(Exception):
    """The base class of tf2's errors. Source: http://wiki.ros.org/tf2/Errors."""

    __module__ = "tf2"


class ConnectivityException(TransformException):
    """Two frames are not connected by transforms."""

    __module__ = "tf2"


class LookupException(TransformException):
    """A frame does not exist, or the transforms form a loop."""

    __module__ = "tf2"


class ExtrapolationException(TransformException):
    """The buffer has no data for the requested time."""

    __module__ = "tf2"


class InvalidArgumentException(TransformException):
    """A frame name is empty, or starts with a slash."""

    __module__ = "tf2"


class TimeoutException(TransformException):
    """A buffer server did not respond in time."""

    __module__ = "tf2"


class MessageException(Exception):
    """Values do not match a message's definition."""


class SerializationError(MessageException):
    """A message contains a value that its definition does not allow."""


class DeserializationError(MessageException):
    """The bytes are not a message of the expected type."""
