"""The states of a server's connection to one client, and a table of their transitions. Pure.

How it works
------------
An event leads from one state to the next; an event that the table does not contain for a
state changes nothing. The state decides whether requests are read, so the shell,
:mod:`minirospy.runtime.rpc.connection`, starts and stops reading only on a transition. All other data of a connection
belongs to the current request or to the output, and may exist in any state:

- the request: received bytes, the next message, the task or steps that process it. Refusing or closing discards them.
- the output: responses that the client has not read. LAST_ANSWER and END_OF_FILE are events only while there are some;
  otherwise the connection closes immediately.
- the time limit for a started request, for unread output, or for a refused client that keeps sending.

In the state REFUSED bytes are still read, because closing the socket with unread bytes would reset the connection, and the
response would be lost.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

__all__ = ["READING", "TRANSITIONS", "Event", "State"]


class State(Enum):
    """The state of a server's connection to one client."""

    OPEN = "requests are read and answered"
    BUSY = "several requests arrived together: no more are read until these are answered"
    FULL = "the client does not read its answers: no requests are read"
    CLOSING = "the connection ends when the client has read its answers"
    REFUSED = "received bytes are ignored, until the client closes the connection or the time is over"
    ENDED = "the socket is closed"

    # use object's hash: Enum's is a Python function that takes longer than a whole transition
    __hash__ = object.__hash__


class Event(Enum):
    """An event of a connection."""

    PIPELINED = "a request arrived before the answer to an earlier one"
    ANSWERED = "the answer to an earlier request has been sent"
    UNREAD = "the unread answers exceed their limit"
    DRAINED = "the client has read all answers"
    LAST_ANSWER = "an answer was the last one, by `Connection: close`; some are unread"
    END_OF_FILE = "the client sends no more requests; some answers are unread"
    REFUSE = "the client violated the protocol or a limit, and has been sent an error"
    END = "the connection is lost, its time is over, or the server closes"

    __hash__ = object.__hash__  # see State


_OPEN, _BUSY, _FULL, _CLOSING, _REFUSED, _ENDED = State

READING = frozenset({_OPEN, _REFUSED})
"""The states in which the socket is read."""

TRANSITIONS: Mapping[Event, Mapping[State, State]] = {
    Event.PIPELINED: {_OPEN: _BUSY},
    Event.ANSWERED: {_BUSY: _OPEN},
    Event.UNREAD: {_OPEN: _FULL},
    Event.DRAINED: {_FULL: _OPEN, _CLOSING: _ENDED},
    Event.LAST_ANSWER: {_OPEN: _CLOSING, _BUSY: _CLOSING, _FULL: _CLOSING},
    Event.END_OF_FILE: {_OPEN: _CLOSING},
    Event.REFUSE: {_OPEN: _REFUSED, _BUSY: _REFUSED, _FULL: _REFUSED},
    Event.END: dict.fromkeys((_OPEN, _BUSY, _FULL, _CLOSING, _REFUSED), _ENDED),
}
