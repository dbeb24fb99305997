"""`rosrun foxglove_bridge foxglove_bridge`: the bridge as a node for launch files, with the parameters of the real bridge.

Tokens come from the environment (MINIROSPY_BRIDGE_TOKEN, MINIROSPY_BRIDGE_READ_TOKEN), never from parameters, which every
node can read. Source: https://github.com/foxglove/ros-foxglove-bridge (README).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from minirospy.aio.node import Node
from minirospy.base.errors import BridgeError
from minirospy.base.name_filter import NameFilter
from minirospy.web.bridge import FOXGLOVE_PORT, Bridge, BridgeOptions
from minirospy.web.foxglove.assets import ALLOWED
from minirospy.web.foxglove.endpoint import CAPABILITIES
from minirospy.web.graph import Filters
from minirospy.web.node_parameters import access_of, address_of, private_parameters, texts, value
from minirospy.web.serve import announce, exit_status, run
from minirospy.web.server.client import Limits

__all__ = ["main", "options_of"]

_WITHOUT_EFFECT = ("use_compression",)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it shuts down; return the exit status."""
    return exit_status("foxglove_bridge", lambda: run("foxglove_bridge", argv, _start, _announce))


async def _start(node: Node) -> Bridge:
    private = await private_parameters(node, _WITHOUT_EFFECT)
    return Bridge(node, options_of(private, os.environ))


def options_of(private: Mapping[str, object], environ: Mapping[str, str]) -> BridgeOptions:
    """Return the options given by a node's private parameters. Raise BridgeError if one of them is invalid."""
    uses_tls = value(private, "tls", bool, False)
    certificate = value(private, "certfile", str, "")
    if uses_tls and not certificate:
        raise BridgeError(
            "~tls is true: ~certfile and ~keyfile have to name the certificate and its key (PEM)"
        )
    topics = NameFilter.of(whitelist=texts(private, "topic_whitelist", [".*"]))
    return BridgeOptions(
        address=address_of(private),
        foxglove_port=value(private, "port", int, FOXGLOVE_PORT),
        access=access_of(private, environ),
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
        max_refresh_interval=value(private, "max_update_ms", int, 1000) / 1000,
    )


def _capabilities(names: Sequence[str]) -> list[str]:
    """Return the configured capabilities except "time", which depends on /use_sim_time, as in foxglove_bridge."""
    unknown = [name for name in names if name not in (*CAPABILITIES, "time")]
    if unknown:
        raise BridgeError(f"~capabilities: {', '.join(unknown)}: known are {', '.join(CAPABILITIES)}")
    return [name for name in names if name != "time"]


def _announce(bridge: Bridge) -> None:
    announce(bridge, "foxglove", "Foxglove protocol at")
