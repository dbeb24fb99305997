"""`rosrun web_video_server web_video_server`: serves images, as a node for launch files.

Source: http://wiki.ros.org/web_video_server.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from minirospy.aio.node import Node
from minirospy.web.bridge import VIDEO_PORT, Bridge, BridgeOptions
from minirospy.web.node_parameters import access_of, address_of, private_parameters, value
from minirospy.web.serve import announce, exit_status, run

__all__ = ["main", "options_of"]

_WITHOUT_EFFECT = ("server_threads", "ros_threads", "publish_rate")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it shuts down; return the exit status."""
    return exit_status("web_video_server", lambda: run("web_video_server", argv, _start, _announce))


async def _start(node: Node) -> Bridge:
    private = await private_parameters(node, _WITHOUT_EFFECT)
    return Bridge(node, options_of(private, os.environ))


def options_of(private: Mapping[str, object], environ: Mapping[str, str]) -> BridgeOptions:
    """Return the options given by a node's private parameters. Raise BridgeError if one of them is invalid."""
    return BridgeOptions(
        address=address_of(private),
        foxglove_port=None,
        video_port=value(private, "port", int, VIDEO_PORT),
        access=access_of(private, environ),
    )


def _announce(bridge: Bridge) -> None:
    announce(bridge, "video", "Waiting For connections on", "http")
