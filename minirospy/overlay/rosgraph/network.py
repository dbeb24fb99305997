"""How this machine is reached, under the words of rosgraph. Source: http://wiki.ros.org/ROS/NetworkSetup."""

from __future__ import annotations

from urllib.parse import urlsplit

from minirospy.environment import Environment

__all__ = ["get_bind_address", "get_host_name", "get_local_address", "parse_http_host_and_port"]


def get_host_name() -> str:
    """The name that other nodes reach this machine by."""
    return Environment.read().host


get_local_address = get_host_name


def get_bind_address(address: str | None = None) -> str:
    """The address that servers listen on."""
    environment = Environment.read(host=address) if address else Environment.read()
    return environment.bind_host


def parse_http_host_and_port(url: str) -> tuple[str, int]:
    """(host, port) of a URL; port 80 where it has none. Raises ValueError."""
    parts = urlsplit(url)
    if not parts.hostname:
        raise ValueError(f"not a URL: {url}")
    return parts.hostname, parts.port or 80
