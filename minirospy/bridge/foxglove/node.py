"""`rosrun foxglove_bridge foxglove_bridge`: the bridge as a node of launch files, with the parameters of the real one.

Tokens come from the environment (MINIROSPY_BRIDGE_TOKEN, MINIROSPY_BRIDGE_READ_TOKEN), never from parameters, which every
node can read. Source: https://github.com/foxglove/ros-foxglove-bridge (README).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from typing import TypeVar

from minirospy.aio.node import Node
from minirospy.bridge.access import Access, NameFilter, is_loopback
from minirospy.bridge.addresses import host_names
from minirospy.bridge.bridge import FOXGLOVE_PORT, Bridge, BridgeOptions
from minirospy.bridge.foxglove.assets import ALLOWED
from minirospy.bridge.foxglove.door import CAPABILITIES
from minirospy.bridge.graph import Filters
from minirospy.bridge.serve import require_libraries, run
from minirospy.bridge.tokens import Tokens, kept_tokens
from minirospy.bridge.web.connection import Limits
from minirospy.environment import Environment
from minirospy.errors import BridgeError, MinirospyError

__all__ = ["main", "options_of"]

_T = TypeVar("_T", str, int, bool)
_WITHOUT_EFFECT = ("use_compression",)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down; return the exit status."""
    try:
        require_libraries()
        return run("foxglove_bridge", sys.argv[1:] if argv is None else argv, _start, _announce)
    except MinirospyError as error:
        print(f"foxglove_bridge: ERROR: {error}", file=sys.stderr)
        return 1


async def _start(node: Node) -> Bridge:
    parameters = await node.get_param("~", {})
    private = parameters if isinstance(parameters, dict) else {}
    for name in _WITHOUT_EFFECT:
        if private.get(name):
            node.log.warning("parameter ~%s has no effect: messages are sent as they are", name)
    return Bridge(node, options_of(private, os.environ))


def options_of(private: Mapping[str, object], environ: Mapping[str, str]) -> BridgeOptions:
    """Return the options that a node's private parameters mean. Raise BridgeError."""
    address = _value(private, "address", str, "127.0.0.1")
    beyond = not is_loopback(address)
    tokens = _tokens(environ, beyond=beyond)
    uses_tls = _value(private, "tls", bool, False)
    certificate = _value(private, "certfile", str, "")
    if uses_tls and not certificate:
        raise BridgeError(
            "~tls is true: ~certfile and ~keyfile have to name the certificate and its key (PEM)"
        )
    topics = NameFilter.of(whitelist=_texts(private, "topic_whitelist", [".*"]))
    return BridgeOptions(
        address=address,
        foxglove_port=_value(private, "port", int, FOXGLOVE_PORT),
        access=Access(
            hosts=tuple(host_names()),
            read_token=tokens.read,
            write_token=tokens.write,
            requires_token=beyond or any(tokens),
        ),
        limits=Limits(queue=max(1, _value(private, "send_buffer_limit", int, 10_000_000))),
        filters=Filters(
            topics=topics,
            publishable=NameFilter.of(whitelist=_texts(private, "client_topic_whitelist", [".*"])),
            services=NameFilter.of(whitelist=_texts(private, "service_whitelist", [".*"])),
            parameters=NameFilter.of(whitelist=_texts(private, "param_whitelist", [".*"])),
        ),
        capabilities=_capabilities(_texts(private, "capabilities", CAPABILITIES)),
        assets=_texts(private, "asset_uri_allowlist", [ALLOWED]),
        certificate=certificate if uses_tls else "",
        key=_value(private, "keyfile", str, "") if uses_tls else "",
        slowest_look=_value(private, "max_update_ms", int, 1000) / 1000,
    )


def _tokens(environ: Mapping[str, str], *, beyond: bool) -> Tokens:
    given = Tokens(environ.get("MINIROSPY_BRIDGE_TOKEN", ""), environ.get("MINIROSPY_BRIDGE_READ_TOKEN", ""))
    return kept_tokens(Environment.read().home) if beyond and not any(given) else given


def _capabilities(names: Sequence[str]) -> list[str]:
    """Return the capabilities of these names; that of time follows /use_sim_time, as in the real bridge."""
    unknown = [name for name in names if name not in (*CAPABILITIES, "time")]
    if unknown:
        raise BridgeError(f"~capabilities: {', '.join(unknown)}: known are {', '.join(CAPABILITIES)}")
    return [name for name in names if name != "time"]


def _value(private: Mapping[str, object], name: str, kind: type[_T], default: _T) -> _T:
    value = private.get(name, default)
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise BridgeError(f"parameter ~{name} is {value!r}: it has to be of type {kind.__name__}")
    return value


def _texts(private: Mapping[str, object], name: str, default: Sequence[str]) -> list[str]:
    value = private.get(name, default)
    if not isinstance(value, list | tuple) or not all(isinstance(each, str) for each in value):
        raise BridgeError(f"parameter ~{name} is {value!r}: it has to be a list of strings")
    return list(value)


def _announce(bridge: Bridge) -> None:
    listener = bridge.listeners["foxglove"]
    scheme = "wss" if listener.is_encrypted else "ws"
    bridge.node.log.info("Foxglove protocol at %s://%s:%d", scheme, listener.host, listener.port)
    if bridge.options.access.requires_token:
        bridge.node.log.info(
            "a token is required: `minirospy bridge --show-tokens` prints those of this user"
        )
