"""Running a bridge as a process: its node, until Ctrl-C, SIGTERM or `rosnode kill`."""

from __future__ import annotations

import asyncio
import importlib
import signal
import sys
from collections.abc import Awaitable, Callable, Sequence
from typing import TYPE_CHECKING, Protocol, TypeVar

from minirospy.aio.node import Node
from minirospy.errors import BridgeError, MinirospyError, ROSInterruptException
from minirospy.installation import install_command
from minirospy.runtime.master.heap import return_large_blocks
from minirospy.runtime.transport.loop import new_event_loop
from minirospy.signal_dispatch import interrupt_signals

if TYPE_CHECKING:
    from minirospy.bridge.bridge import Bridge

__all__ = ["Part", "announce", "exit_status", "require_libraries", "run", "run_program"]


_LARGE_BLOCK = 4 * 1024 * 1024
"""Bytes of a block that goes back to the system when it is freed; a camera's images are smaller, and mapping each costs time."""


class Part(Protocol):
    """What a node does: a bridge, or services."""

    async def start(self) -> None: ...

    async def close(self) -> None: ...


_P = TypeVar("_P", bound=Part)


def require_libraries() -> None:
    """Raise BridgeError with what to install where the library of the web servers is missing."""
    try:
        import websockets.server  # noqa: F401 only whether it is there
    except ImportError as error:
        raise BridgeError(
            f"the bridge needs the library {error.name}: {install_command('minirospy[web]')}"
        ) from error


def run_program(name: str, module: str) -> int:
    """Run a node's program, whose module imports the libraries; return the exit status, 1 where one is missing."""

    def body() -> int:
        require_libraries()
        return int(importlib.import_module(module).main())

    return exit_status(name, body)


def exit_status(name: str, body: Callable[[], int]) -> int:
    """Return the exit status of a program; 1 where ``body`` raises MinirospyError, which is printed in one line."""
    try:
        return body()
    except MinirospyError as error:
        print(f"{name}: ERROR: {error}", file=sys.stderr)
        return 1


def announce(bridge: Bridge, door: str, text: str, scheme: str = "ws") -> None:
    """Log where a door is, and whether it needs a token."""
    listener = bridge.listeners[door]
    scheme += "s" if listener.is_encrypted else ""
    bridge.node.log.info("%s %s://%s:%d", text, scheme, listener.host, listener.port)
    if bridge.options.access.requires_token:
        bridge.node.log.info(
            "a token is required: `minirospy bridge --show-tokens` prints those of this user"
        )


def run(
    name: str,
    argv: Sequence[str] | None,
    start: Callable[[Node], Awaitable[_P]],
    on_started: Callable[[_P], None],
    *,
    imports_messages: bool = True,
) -> int:
    """Run a bridge on a node of this name until it is shut down; return the exit status.

    ``argv``: remappings, as a launch file gives them; None: those of the process. ``start`` makes the bridge,
    ``on_started`` shows its addresses. Without ``imports_messages`` the node has neither /rosout nor simulated time, for which
    it would import message classes.
    """
    return_large_blocks(_LARGE_BLOCK)
    loop = new_event_loop()
    try:
        words = sys.argv[1:] if argv is None else argv
        node = Node(name, argv=words, rosout=imports_messages, simulated_time=imports_messages)
        return loop.run_until_complete(_run(node, start, on_started))
    finally:
        loop.close()


async def _run(
    node: Node,
    start: Callable[[Node], Awaitable[_P]],
    on_started: Callable[[_P], None],
) -> int:
    loop = asyncio.get_running_loop()
    main = asyncio.current_task()
    assert main
    interrupted = False

    def interrupt() -> None:
        nonlocal interrupted
        interrupted = True
        # Before there is a master, the wait for it ends; later the node shuts down.
        if node.is_started:
            node.shutdown("signal")
        else:
            main.cancel()

    before = {
        number: signal.signal(number, lambda *_: loop.call_soon_threadsafe(interrupt))
        for number in (*interrupt_signals(), signal.SIGTERM)
    }
    # On Windows a signal is noticed when the loop next wakes up.
    ticking = asyncio.ensure_future(_tick())
    try:
        async with node:
            bridge = await start(node)
            try:
                await bridge.start()
                on_started(bridge)
                await node.spin()
            finally:
                await bridge.close()
    except (asyncio.CancelledError, ROSInterruptException):
        if not interrupted:
            raise
    finally:
        ticking.cancel()
        for number, handler in before.items():
            signal.signal(number, handler)
    return 0


async def _tick() -> None:
    while True:
        await asyncio.sleep(0.5)
