"""`rosrun web_video_server web_video_server`: images as a node of launch files. Source: http://wiki.ros.org/web_video_server."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from minirospy.aio.node import Node
from minirospy.bridge.access import Access, is_loopback
from minirospy.bridge.addresses import host_names
from minirospy.bridge.bridge import VIDEO_PORT, Bridge, BridgeOptions
from minirospy.bridge.node_parameters import tokens_of, value
from minirospy.bridge.serve import require_libraries, run
from minirospy.errors import MinirospyError

__all__ = ["main", "options_of"]

_WITHOUT_EFFECT = ("server_threads", "ros_threads", "publish_rate")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down; return the exit status."""
    try:
        require_libraries()
        return run("web_video_server", sys.argv[1:] if argv is None else argv, _start, _announce)
    except MinirospyError as error:
        print(f"web_video_server: ERROR: {error}", file=sys.stderr)
        return 1


async def _start(node: Node) -> Bridge:
    parameters = await node.get_param("~", {})
    private = parameters if isinstance(parameters, dict) else {}
    for name in _WITHOUT_EFFECT:
        if name in private:
            node.log.warning("parameter ~%s has no effect", name)
    return Bridge(node, options_of(private, os.environ))


def options_of(private: Mapping[str, object], environ: Mapping[str, str]) -> BridgeOptions:
    """Return the options that a node's private parameters mean. Raise BridgeError."""
    address = value(private, "address", str, "127.0.0.1")
    beyond = not is_loopback(address)
    tokens = tokens_of(environ, beyond=beyond)
    return BridgeOptions(
        address=address,
        foxglove_port=None,
        video_port=value(private, "port", int, VIDEO_PORT),
        access=Access(
            hosts=tuple(host_names()),
            read_token=tokens.read,
            write_token=tokens.write,
            requires_token=beyond or any(tokens),
        ),
    )


def _announce(bridge: Bridge) -> None:
    listener = bridge.listeners["video"]
    bridge.node.log.info("Waiting For connections on http://%s:%d", listener.host, listener.port)
    if bridge.options.access.requires_token:
        bridge.node.log.info(
            "a token is required: `minirospy bridge --show-tokens` prints those of this user"
        )
