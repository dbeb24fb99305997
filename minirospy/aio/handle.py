"""The common base of publishers, subscriptions and services, which register in the background."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Generator
from types import TracebackType
from typing import TypeVar

from minirospy.base.errors import (
    MasterUnreachableError,
    ROSSerializationException,
    RpcError,
    RpcRefused,
    SerializationError,
)
from minirospy.core.idl.protocols import Message
from minirospy.core.wire.framing import Pieces
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

__all__ = ["Handle", "pieces_of", "registered", "serialized"]

_T = TypeVar("_T")
_H = TypeVar("_H", bound="Handle")


class Handle:
    """The base class of publishers, subscriptions and services. ``await handle`` waits until it is registered with the master."""

    _registration: asyncio.Task[None]

    def __await__(self: _H) -> Generator[object, None, _H]:
        yield from asyncio.shield(self._registration).__await__()
        return self

    async def __aenter__(self: _H) -> _H:
        return await self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def wait_until_registered(self) -> None:
        """Wait until the registration has finished. Unlike ``await handle``, does not raise if it failed or was cancelled."""
        await asyncio.wait([self._registration])

    async def close(self) -> None:
        """Close the handle and unregister it."""
        raise NotImplementedError


async def registered(
    register: Callable[[_T], Awaitable[None]], part: _T, what: str, faults: RateLimitedLogger
) -> None:
    """Wait for a registration to finish. If it fails, log the error instead of raising it, as rospy does."""
    try:
        await register(part)
    except (MasterUnreachableError, RpcError) as error:
        why = error.text if isinstance(error, RpcRefused) else error
        faults.critical("unable to register %s with master: %s", what, why)
        faults.close_later(asyncio.get_running_loop())


def pieces_of(message: Message) -> Pieces:
    pieces = Pieces()
    try:
        message.serialize(pieces)
    except (SerializationError, OverflowError) as error:
        raise ROSSerializationException(str(error)) from error
    return pieces


def serialized(message: Message) -> bytes:
    return b"".join(pieces_of(message))
