"""`rosrun rosbridge_server rosbridge_websocket`: rosbridge as a node for launch files, with the real node's parameters.

As for foxglove_bridge, tokens come from the environment. Source: http://wiki.ros.org/rosbridge_suite.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace

from minirospy.aio.node import Node
from minirospy.base.errors import BridgeError
from minirospy.base.name_filter import NameFilter
from minirospy.web.bridge import ROSBRIDGE_PORT, Bridge, BridgeOptions
from minirospy.web.graph import Filters
from minirospy.web.node_parameters import access_of, address_of, globs, number, private_parameters, value
from minirospy.web.rosbridge.shared import RosbridgeOptions
from minirospy.web.serve import announce, exit_status, run
from minirospy.web.server.client import Limits

__all__ = ["main", "options_of", "refuse"]

_WITHOUT_EFFECT = ("use_compression", "delay_between_messages", "websocket_external_port")
_ARGUMENTS = (
    *("port", "address", "certfile", "keyfile", "retry_startup_delay", "fragment_timeout"),
    *("delay_between_messages", "max_message_size", "unregister_timeout", "topics_glob", "services_glob"),
    *("params_glob", "websocket_ping_interval", "websocket_ping_timeout"),
)
"""Parameters that may also be passed as options, such as `--port 9090`."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it shuts down; return the exit status."""

    def body() -> int:
        given, rest = _arguments(sys.argv[1:] if argv is None else argv)

        async def start(node: Node) -> Bridge:
            private = await private_parameters(node, _WITHOUT_EFFECT, given)
            return Bridge(node, options_of(private, os.environ))

        return run("rosbridge_websocket", rest, start, _announce)

    return exit_status("rosbridge_websocket", body)


def refuse(program: str) -> int:
    """Print that minirospy does not include a server of rosbridge_suite; return the exit status."""
    print(
        f"{program}: ERROR: minirospy serves rosbridge over WebSocket only: start rosbridge_websocket "
        "(rosrun rosbridge_server rosbridge_websocket)",
        file=sys.stderr,
    )
    return 1


def options_of(private: Mapping[str, object], environ: Mapping[str, str]) -> BridgeOptions:
    """Return the options given by a node's private parameters. Raise BridgeError if one of them is invalid."""
    if private.get("bson_only_mode") or private.get("binary_encoder") == "bson":
        raise BridgeError("BSON is not offered: subscribe with compression cbor, which is as small")
    services = globs(private, "services_glob")
    most = _size(private)
    ping = number(private, "websocket_ping_interval", 0.0)
    limits = Limits()
    if ping:
        silent = ping + number(private, "websocket_ping_timeout", 30.0)
        limits = Limits(ping_seconds=ping, silent_seconds=silent)
    topics = NameFilter.of(globs(private, "topics_glob"))
    return BridgeOptions(
        address=address_of(private),
        foxglove_port=None,
        rosbridge_port=value(private, "port", int, ROSBRIDGE_PORT),
        access=replace(
            access_of(
                private, environ, origins=["null"] if private.get("websocket_null_origin") is True else []
            ),
            file_option="websocket_null_origin:=true",
        ),
        limits=limits,
        filters=Filters(
            topics=topics,
            publishable=topics,
            # Allow rosapi's services, which programs call to find topics and services.
            services=NameFilter.of([*services, "/rosapi/*"] if services else ()),
            parameters=NameFilter.of(globs(private, "params_glob")),
        ),
        certificate=value(private, "certfile", str, ""),
        key=value(private, "keyfile", str, ""),
        rosbridge=RosbridgeOptions(
            fragment_timeout=number(private, "fragment_timeout", 600.0),
            unregister_timeout=number(private, "unregister_timeout", 10.0),
            fragment_size=most,
            authenticate=value(private, "authenticate", bool, False),
        ),
        retry_delay=number(private, "retry_startup_delay", 2.0),
    )


def _size(private: Mapping[str, object]) -> int | None:
    """Return the size above which messages to clients are fragmented.

    As in rosbridge, the parameter limits only messages to clients.
    """
    if private.get("max_message_size") in (None, "None", ""):
        return None
    most = value(private, "max_message_size", int, 0)
    if most < 100:
        raise BridgeError(f"parameter ~max_message_size is {most}: a message has 100 characters and more")
    return most


def _arguments(argv: Sequence[str]) -> tuple[dict[str, object], list[str]]:
    """Return the parameters given as `--name value`, and all other arguments, which are remappings."""
    from minirospy.introspect.values import parse_value

    given: dict[str, object] = {}
    rest: list[str] = []
    words = iter(argv)
    for word in words:
        name = word.removeprefix("--")
        if not word.startswith("--"):
            rest.append(word)
        elif name not in _ARGUMENTS:
            raise BridgeError(f"{word} is unknown: there is {', '.join('--' + each for each in _ARGUMENTS)}")
        else:
            text = next(words, None)
            if text is None:
                raise BridgeError(f"{word} argument provided without a value")
            given[name] = text if name.endswith("glob") else parse_value(text)
    return given, rest


def _announce(bridge: Bridge) -> None:
    announce(bridge, "rosbridge", "Rosbridge WebSocket server started at")
