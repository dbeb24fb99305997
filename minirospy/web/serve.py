"""Run a bridge as a process with a node, until Ctrl-C, SIGTERM or `rosnode kill`."""

from __future__ import annotations

import asyncio
import gc
import importlib
import signal
import sys
from collections.abc import Awaitable, Callable, Sequence
from typing import TYPE_CHECKING, Protocol, TypeVar

from minirospy.aio.node import MAX_REGISTRATION_FAULTS, Node
from minirospy.base.errors import BridgeError, MinirospyError, ROSInterruptException
from minirospy.base.escape import escaped
from minirospy.base.heap import return_large_blocks
from minirospy.base.installation import install_command
from minirospy.base.signal_dispatch import interrupt_signals
from minirospy.runtime.transport.loop import new_event_loop

if TYPE_CHECKING:
    from minirospy.web.bridge import Bridge

__all__ = [
    "LIBRARIES",
    "Part",
    "announce",
    "exit_status",
    "prefer_the_loop",
    "require_libraries",
    "run",
    "run_program",
]


LIBRARIES = (
    "websockets",
    "segno",
    "cbor2",
)  # packages that the dashboard and the bridges need, and on which minirospy depends

_LARGE_BLOCK = 4 * 1024 * 1024
"""Minimum size in bytes of freed blocks to return to the system. Camera images are smaller: returning them is too slow."""


class Part(Protocol):
    """A bridge, or a set of services, that a node runs."""

    async def start(self) -> None: ...

    async def close(self) -> None: ...


_P = TypeVar("_P", bound=Part)

# GIL switch interval in seconds: with Python's default of 5 ms, the loop could wait that long after each call
_SWITCH_SECONDS = 0.0005


def prefer_the_loop() -> None:
    """Reduce delays of the event loop by the garbage collector and by threads that process large messages.

    Call this after all imports: otherwise the collector visits the imported objects, which takes 15 ms each time a client
    sends thousands of arrays.
    """
    sys.setswitchinterval(min(sys.getswitchinterval(), _SWITCH_SECONDS))
    gc.collect()
    gc.freeze()


def require_libraries() -> None:
    """Raise BridgeError with the install command if the web servers' library is missing."""
    try:
        import websockets.server  # noqa: F401 only whether it is there
    except ImportError as error:
        raise BridgeError(
            f"the bridge needs the library {error.name}: {install_command(*LIBRARIES)}"
        ) from error


def run_program(name: str, module: str) -> int:
    """Run the program in ``module``, which imports the libraries. Return its exit status, or 1 if a library is missing."""

    def body() -> int:
        require_libraries()
        return int(importlib.import_module(module).main())

    return exit_status(name, body)


def exit_status(name: str, body: Callable[[], int]) -> int:
    """Run ``body``; return its exit status. If it raises MinirospyError, print the error on one line and return 1."""
    try:
        return body()
    except MinirospyError as error:
        print(f"{name}: ERROR: {error}", file=sys.stderr)
        return 1


def announce(bridge: Bridge, endpoint: str, text: str, scheme: str = "ws") -> None:
    """Log the URL of an endpoint, and whether it requires a token."""
    listener = bridge.listeners[endpoint]
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
    registration_fault_lines: int = MAX_REGISTRATION_FAULTS,
    connect: Callable[[_P], Awaitable[None]] | None = None,
) -> int:
    """Run a bridge on a node called ``name`` until the node shuts down; return the exit status.

    ``argv``: remappings, as a launch file passes them (None: the process's own arguments). ``start`` creates the bridge,
    ``on_started`` shows its addresses. Without ``imports_messages`` the node has neither /rosout nor simulated time,
    which would import message classes. ``registration_fault_lines`` is passed to the node. ``connect`` opens
    resources that may fail, before the node registers its name, because the master ends a running node with the same
    name.
    """
    return_large_blocks(_LARGE_BLOCK)
    loop = new_event_loop()
    try:
        words = sys.argv[1:] if argv is None else argv
        node = Node(
            name,
            argv=words,
            rosout=imports_messages,
            simulated_time=imports_messages,
            registration_fault_lines=registration_fault_lines,
        )
        return loop.run_until_complete(_run(node, start, on_started, connect))
    finally:
        loop.close()


async def _run(
    node: Node,
    start: Callable[[Node], Awaitable[_P]],
    on_started: Callable[[_P], None],
    connect: Callable[[_P], Awaitable[None]] | None = None,
) -> int:
    loop = asyncio.get_running_loop()
    main = asyncio.current_task()
    assert main
    interrupted = False

    def interrupt() -> None:
        nonlocal interrupted
        interrupted = True
        # If the node is still waiting for a master, cancel the wait; otherwise, shut down the node.
        if node.is_started:
            node.shutdown("signal")
        else:
            main.cancel()

    before = {
        number: signal.signal(number, lambda *_: loop.call_soon_threadsafe(interrupt))
        for number in (*interrupt_signals(), signal.SIGTERM)
    }
    # On Windows, Python handles signals only when the loop wakes up, so wake it periodically.
    ticking = asyncio.ensure_future(_tick())
    bridge: _P | None = None
    try:
        if connect is not None:
            node.start_logging()
            bridge = await start(node)
            await connect(bridge)
        async with node:
            if bridge is None:
                bridge = await start(node)
            try:
                await bridge.start()
                on_started(bridge)
                prefer_the_loop()
                await node.spin()
                if node.shutdown_request:
                    node.log.warning("shutdown request: %s", escaped(node.shutdown_request))
            finally:
                await bridge.close()
    except (asyncio.CancelledError, ROSInterruptException):
        if not interrupted:
            raise
    finally:
        if bridge is not None:
            await bridge.close()  # needed if the node failed to start
        ticking.cancel()
        for number, handler in before.items():
            signal.signal(number, handler)
    return 0


async def _tick() -> None:
    while True:
        await asyncio.sleep(0.5)
