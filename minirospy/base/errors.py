"""Every error that minirospy raises on purpose.

::

    Exception
    +-- MinirospyError                  a fault that we name: one clear line for a person in str()
    |   +-- UsageError                  usage error of a command (exit status 2)
    |   +-- NotFoundError               a package, node, type, topic or file that does not exist (with similar names)
    |   +-- MasterUnreachableError      no master answers at the URI
    |   +-- NodeUnreachableError        a node that the master knows does not answer
    |   +-- RpcError                    a remote procedure call (XML-RPC) went wrong
    |   |   +-- RpcFault                the peer answered with an XML-RPC fault
    |   |   +-- RpcRefused              the peer answered with a status code other than 1
    |   |   +-- RpcProtocolError        the peer's bytes are not HTTP or not XML-RPC
    |   |   +-- RpcUnreachable          the peer could not be reached, or did not answer in time
    |   +-- WireError                   bytes that are not TCPROS
    |   |   +-- HandshakeRefused        the peer answered a connection header with ``error=``
    |   |   +-- CallFailed              the service answered a call with an error
    |   +-- SourceError                 a text that a person wrote (file, line)
    |   |   +-- DefinitionError         a .msg, .srv or .action text that does not parse
    |   |   +-- ManifestError           a package.xml that does not read
    |   |   +-- BuildError              a workspace or package that cannot be built
    |   |   +-- LaunchError             a launch file that does not load
    |   |   +-- UrdfError               a robot description that does not read
    |   |   +-- RvizFileError           a .rviz file that cannot be read or written
    |   +-- BagError                    a bag that cannot be read or written
    |   |   +-- BagFormatError          bytes that are not what the bag format prescribes
    |   |   +-- BagVersionError         a version of the format that cannot be read
    |   |   +-- BagUnindexedError       a bag without its index: it was not closed, or its end is missing
    |   |   |   `-- McapUnindexedError  an MCAP file without its summary, likewise
    |   |   +-- BagEncryptedError       the bag is encrypted
    |   |   +-- BagCompressionError     a compression that is unknown, or whose library is missing
    |   +-- BoardError                  the virtual board cannot be reached
    |   +-- BridgeError                 the bridge to browsers cannot be started, or refuses a request
    |   |   +-- BridgeProtocolError     a client's message that is not of its protocol
    |   +-- ValueTextError              a typed value that is not YAML, or does not fit its target
    +-- ROSException                    rospy's tree (http://wiki.ros.org/rospy/Overview/Exceptions)
    |   +-- ROSInitException
    |   +-- ThreadLimitError            the system lets this process start no more threads
    |   +-- ROSSerializationException
    |   +-- ROSInterruptException
    |   |   +-- ROSTimeMovedBackwardsException
    |   +-- ROSInternalException
    |       +-- TransportException
    |           +-- TransportInitError
    |           +-- TransportTerminated
    +-- ServiceException                a service call failed, here or there
    +-- TransformException              tf2's tree (http://wiki.ros.org/tf2/Errors)
    |   +-- ConnectivityException       the two frames are in different trees
    |   +-- LookupException             a frame that no transform has named, or a loop
    |   +-- ExtrapolationException      a time without data
    |   +-- InvalidArgumentException    a frame's name that is empty or starts with a slash
    |   +-- TimeoutException            a buffer server that does not answer
    +-- MessageException                genpy's tree: values and bytes that do not fit a message
        +-- SerializationError
        |   +-- SerializationOverflowError
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
    "SerializationError",
    "SerializationOverflowError",
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
    """The root of our own errors; ``str()`` is one line for a person."""


class UsageError(MinirospyError):
    """A command was called with wrong arguments."""


class NotFoundError(MinirospyError):
    """Something named does not exist; the text suggests similar names that do.

    ``kind`` is what was looked up ("package", "message type"), ``name`` the name that was given,
    ``known`` every name that exists, ``hint`` what to do.
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
    """No master answers at ``uri``; ``why``: what keeps this process from calling it; ``cause``: why it does not answer."""

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
    """The node (or another ``kind``: "service") ``name``, registered at ``uri``, does not answer."""

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
"""What to say of a process that answers nothing."""


class RpcError(MinirospyError):
    """A remote procedure call went wrong."""


class RpcFault(RpcError):
    """The peer answered with an XML-RPC fault."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(code, text)
        self.code = code
        self.text = text

    def __str__(self) -> str:
        return f"XML-RPC fault {self.code}: {self.text}"


class RpcRefused(RpcError):
    """A ROS API call was answered with a status ``code`` other than 1 (0 failure, -1 error)."""

    def __init__(self, method: str, code: int, text: str) -> None:
        super().__init__(method, code, text)
        self.method = method
        self.code = code
        self.text = text

    def __str__(self) -> str:
        return f"{self.method}: {self.text}"


class RpcProtocolError(RpcError):
    """The bytes of a peer are not HTTP, or not XML-RPC; ``status`` is the HTTP status that a server answers with."""

    def __init__(self, text: str, *, status: int = 400) -> None:
        super().__init__(text)
        self.status = status


class RpcUnreachable(RpcError):
    """The peer at ``uri`` could not be reached, or did not answer in time."""

    def __init__(self, uri: str, why: str) -> None:
        super().__init__(uri, why)
        self.uri = uri
        self.why = why

    def __str__(self) -> str:
        return f"no answer from {self.uri}: {self.why}"


class RpcTimeout(RpcUnreachable):
    """The peer took the connection, and did not answer in time: its process is stopped, or busy."""

    def __init__(self, uri: str, seconds: float) -> None:
        super().__init__(uri, f"timed out after {seconds:g} s")
        self.seconds = seconds

    def __reduce__(self) -> tuple[type[RpcTimeout], tuple[str, float]]:
        return RpcTimeout, (self.uri, self.seconds)


class WireError(MinirospyError):
    """Bytes that are not TCPROS."""


class HandshakeRefused(WireError):
    """The peer answered our connection header with ``error=text``."""


class CallFailed(WireError):
    """The service answered a call with an error; ``text`` as its handler's stack encoded it."""

    def __init__(self, text: bytes) -> None:
        super().__init__(text)
        self.text = text

    def __str__(self) -> str:
        return self.text.decode("utf-8", "replace")


class SourceError(MinirospyError):
    """A text that a person wrote does not do: ``file`` (or what else names it), ``line`` (from 1; 0: the whole)."""

    def __init__(self, file: str, line: int, text: str) -> None:
        super().__init__(file, line, text)
        self.file = file
        self.line = line
        self.text = text

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.text}" if self.line else f"{self.file}: {self.text}"


class DefinitionError(SourceError):
    """An interface definition does not parse; of one without a file, ``file`` is its type."""


class ManifestError(SourceError):
    """A package.xml does not read."""


class BuildError(SourceError):
    """A workspace or a package cannot be built."""


class LaunchError(SourceError):
    """A launch file does not load."""


class RvizFileError(SourceError):
    """A .rviz file cannot be read or written."""


class UrdfError(SourceError):
    """A robot description does not read. ``context``: in what, as ROS's reader has it, from the inside to the outside."""

    def __init__(self, file: str, line: int, text: str, context: tuple[str, ...] = ()) -> None:
        super().__init__(file, line, ": ".join((text, *context[:1])))
        self.trail = (text, *context)


class BagError(MinirospyError):
    """A bag cannot be read or written; ``str()`` does not name the file, which the caller knows."""


class BagFormatError(BagError):
    """The bytes at ``position`` are not what the bag format prescribes; None: of the whole file."""

    def __init__(self, why: str, position: int | None = None) -> None:
        super().__init__(why, position)
        self.why = why
        self.position = position

    def __str__(self) -> str:
        return self.why if self.position is None else f"{self.why} (at byte {self.position})"


class NoBagError(BagFormatError):
    """The file does not start as a bag does."""


class BagVersionError(BagError):
    """The bag has a ``version`` (101 is 1.1) that cannot be read, or not be used for this purpose."""

    def __init__(self, version: int, why: str) -> None:
        super().__init__(version, why)
        self.version = version
        self.why = why

    def __str__(self) -> str:
        return self.why


class BagUnindexedError(BagError):
    """The bag was not closed, or its index is damaged; ``why`` is the fault that was found, if one was."""

    def __init__(self, why: str = "") -> None:
        super().__init__(why)
        self.why = why

    def __str__(self) -> str:
        return "Unindexed bag"


class McapUnindexedError(BagUnindexedError):
    """The MCAP file was not completed, or its summary is damaged; ``why`` is the fault."""

    def __str__(self) -> str:
        return f"the MCAP file is not complete: {self.why}"


class BagEncryptedError(BagError):
    """The bag is encrypted by ``encryptor``, a plugin of rosbag that is not supported."""

    def __init__(self, encryptor: str) -> None:
        super().__init__(encryptor)
        self.encryptor = encryptor

    def __str__(self) -> str:
        return (
            f"the bag is encrypted by [{self.encryptor}], which is not supported: "
            "decrypt it by `rosbag decrypt` of ROS where its key is installed"
        )


class BagCompressionError(BagError):
    """Chunks with this ``compression`` cannot be read or written; ``why`` states the reason."""

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
    """A client's message that is not of its protocol."""


class ValueTextError(MinirospyError):
    """A value as a person typed it (``text``, or the name of the file or parameter) cannot be used; ``why``."""

    def __init__(self, text: str, why: str) -> None:
        super().__init__(text, why)
        self.text = text
        self.why = why

    def __str__(self) -> str:
        shown = " ".join(self.text.split())
        return f"'{shown if len(shown) <= 60 else shown[:57] + '...'}': {self.why}"


class ROSException(Exception):
    """The root of rospy's errors."""


class ROSInitException(ROSException):
    """A node could not be initialised."""


class ThreadLimitError(ROSException):
    """The system lets this process start no more threads; ``limits`` are those that are known."""

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
    """Python 3.12.0 to 3.12.2 start no more threads once the main thread has ended (CPython issue 113964)."""

    def __init__(self) -> None:
        super().__init__(0, [])

    def __str__(self) -> str:
        return (
            "Python 3.12.0 to 3.12.2 start no more threads once the main thread has ended, which nodes need until their "
            "end: use 3.12.3 or later"
        )


class ROSSerializationException(ROSException):
    """A message could not be serialised or deserialised."""


class ROSInterruptException(ROSException):
    """A blocking call was ended by the node's shutdown. That of rospy is a subclass: `minirospy.client.lifecycle`."""


class ROSTimeMovedBackwardsException(ROSInterruptException):
    """Simulated time jumped back to ``time`` seconds before the start of a sleep."""

    def __init__(self, time: float) -> None:
        super().__init__("ROS time moved backwards")
        self.time = time


class ROSInternalException(ROSException):
    """A fault inside the client library."""


class TransportException(ROSInternalException):
    """A connection to a peer went wrong."""


class TransportInitError(TransportException):
    """A connection to a peer could not be set up."""


class TransportTerminated(TransportException):
    """A connection to a peer ended."""


class ServiceException(Exception):
    """A service call failed: no provider, a broken link, or the handler's own error."""


class TransformException(Exception):
    """The root of tf2's errors. Source: http://wiki.ros.org/tf2/Errors."""

    __module__ = "tf2"


class ConnectivityException(TransformException):
    """Two frames are not connected by transforms."""

    __module__ = "tf2"


class LookupException(TransformException):
    """A frame does not exist, or the transforms form a loop."""

    __module__ = "tf2"


class ExtrapolationException(TransformException):
    """The buffer has no data for the time of a lookup."""

    __module__ = "tf2"


class InvalidArgumentException(TransformException):
    """A frame's name is empty, or starts with a slash."""

    __module__ = "tf2"


class TimeoutException(TransformException):
    """A buffer server did not answer in time."""

    __module__ = "tf2"


class MessageException(Exception):
    """Values that do not fit a message."""


class SerializationError(MessageException):
    """A message holds a value that its definition does not allow."""


class SerializationOverflowError(SerializationError, OverflowError):
    """A number that a float32 does not hold: to programs for genpy an OverflowError, to ours an error like the others."""


class DeserializationError(MessageException):
    """Bytes that are not a message of this type."""
