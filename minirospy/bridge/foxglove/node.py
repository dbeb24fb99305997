"""`rosrun foxglove_bridge foxglove_bridge`: the bridge as a node of launch files, with the parameters of the real one.

Tokens come from the environment (MINIROSPY_BRIDGE_TOKEN, MINIROSPY_BRIDGE_READ_TOKEN), never from parameters, which every
node can read. Source: https://github.com/foxglove/ros-foxglove-bridge (README).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from minirospy.aio.node import Node
from minirospy.bridge.access import Access, NameFilter, is_loopback
from minirospy.bridge.addresses import host_names
from minirospy.bridge.bridge import FOXGLOVE_PORT, Bridge, BridgeOptions
from minirospy.bridge.foxglove.assets import ALLOWED
from minirospy.bridge.foxglove.door import CAPABILITIES
from minirospy.bridge.graph import Filters
from minirospy.bridge.node_parameters import texts, tokens_of, value
from minirospy.bridge.serve import require_libraries, run
from minirospy.bridge.web.connection import Limits
from minirospy.errors import BridgeError, MinirospyError

__all__ = ["main", "options_of"]

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
    address = value(private, "address", str, "127.0.0.1")
    beyond = not is_loopback(address)
    tokens = tokens_of(environ, beyond=beyond)
    uses_tls = value(private, "tls", bool, False)
    certificate = value(private, "certfile", str, "")
    if uses_tls and not certificate:
        raise BridgeError(
            "~tls is true: ~certfile and ~keyfile have to name the certificate and its key (PEM)"
        )
    topics = NameFilter.of(whitelist=texts(private, "topic_whitelist", [".*"]))
    return BridgeOptions(
        address=address,
        foxglove_port=value(private, "port", int, FOXGLOVE_PORT),
        access=Access(
            hosts=tuple(host_names()),
            read_token=tokens.read,
            write_token=tokens.write,
            requires_token=beyond or any(tokens),
        ),
        limits=Limits(queue=max(1, value(private, "send_buffer_limit", int, 10_000_000))),
        filters=Filters(
            topics=topics,
            publishable=NameFilter.of(whitelist=texts(private, "client_topic_whitelist", [".*"])),
            services=NameFilter.of(whitelist=texts(private, "service_whitelist", [".*"])),
            parameters=NameFilter.of(whitelist=texts(private, "param_whitelist", [".*"])),
        ),
        capabilities=_capabilities(texts(private, "capabilities", CAPABILITIES)),
        assets=texts(private, "asset_uri_allowlist", [ALLOWED]),
        certificate=certificate if uses_tls else "",
        key=value(private, "keyfile", str, "") if uses_tls else "",
        slowest_look=value(private, "max_update_ms", int, 1000) / 1000,
    )


def _capabilities(names: Sequence[str]) -> list[str]:
    """Return the capabilities of these names; that of time follows /use_sim_time, as in the real bridge."""
    unknown = [name for name in names if name not in (*CAPABILITIES, "time")]
    if unknown:
        raise BridgeError(f"~capabilities: {', '.join(unknown)}: known are {', '.join(CAPABILITIES)}")
    return [name for name in names if name != "time"]


def _announce(bridge: Bridge) -> None:
    listener = bridge.listeners["foxglove"]
    scheme = "wss" if listener.is_encrypted else "ws"
    bridge.node.log.info("Foxglove protocol at %s://%s:%d", scheme, listener.host, listener.port)
    if bridge.options.access.requires_token:
        bridge.node.log.info(
            "a token is required: `minirospy bridge --show-tokens` prints those of this user"
        )
