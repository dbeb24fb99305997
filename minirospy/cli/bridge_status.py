"""`minirospy bridge --status`: show the protocols that running bridges serve, and their clients."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

from minirospy.base.errors import BridgeError

__all__ = ["show_status"]

ANSWER_SECONDS = 5.0
_MAX_BYTES = 10_000_000
_SCHEMES = {"video": "http"}
_Json = Any


class _Token(NamedTuple):
    """A token. ``is_kept`` is true if it was read from ROS_HOME, where this user's bridges store their tokens."""

    text: str
    is_kept: bool


class _NoBridgeError(BridgeError):
    """Raised if no bridge responds on a port."""


def show_status(ports: Sequence[int], token: str, *, as_json: bool) -> int:
    """Print the status of the local bridges on the given ports; return the exit status.

    Raise BridgeError if no bridge responds, or one refuses access.
    """
    found: dict[str, _Json] = {}
    faults: list[BridgeError] = []
    for port in ports:
        try:
            status = _fetch(port, _token(token))
        except BridgeError as error:
            faults.append(error)
        else:
            # A bridge has several ports, one per protocol, so list each bridge only once.
            found.setdefault(status["node"], status)

    if as_json and found:
        statuses = list(found.values())
        print(json.dumps(statuses[0] if len(ports) == 1 else statuses, indent=1))
    elif found:
        for status in found.values():
            _print_bridge(status)
    refusals = [fault for fault in faults if not isinstance(fault, _NoBridgeError)]
    if refusals:
        raise refusals[0]
    if found:
        return 0
    if len(ports) == 1:
        raise faults[0]
    listed = ", ".join(map(str, ports))
    raise BridgeError(f"no bridge answers at the ports {listed} of this machine: give --port, or start one")


def _print_bridge(found: _Json) -> None:
    print(f"node [{found['node']}], for {found['seconds']:.0f} s")
    for name, endpoint in found["endpoints"].items():
        url = _url(_SCHEMES.get(name, "ws"), endpoint)
        refused = f", {endpoint['refused']} refused" if endpoint["refused"] else ""
        print(f"{name}: {url}, {endpoint['connections']} connections{refused}")
    if "video" not in found["endpoints"]:
        print(f"video: {', '.join(_url('http', endpoint) for endpoint in found['endpoints'].values())}")
    print(f"{len(found['topics'])} topics subscribed")
    for client in found["clients"]:
        print(
            f" * {client['address']} ({client['endpoint']}, {client['rights']}, {client['seconds']:.0f} s): "
            f"{client['sent']} messages sent ({_size(client['sent_bytes'])}), {client['dropped']} dropped, "
            f"{client['waiting']} waiting ({_size(client['waiting_bytes'])}), {client['received']} received"
        )


def _url(scheme: str, endpoint: _Json) -> str:
    return f"{scheme}{'s' if endpoint['encrypted'] else ''}://{endpoint['address']}:{endpoint['port']}"


def _token(given: str) -> _Token:
    from minirospy.base.environment import Environment
    from minirospy.web.tokens import read_tokens

    if given:
        return _Token(given, is_kept=False)
    kept = read_tokens(Environment.read().home)
    return _Token(kept.read if kept else "", is_kept=True)


def _fetch(port: int, token: _Token) -> _Json:
    """Fetch a bridge's status page and return its JSON."""
    import http.client
    import ssl

    # The server is on this machine, so do not verify its certificate.
    context = ssl._create_unverified_context()
    plain = http.client.HTTPConnection("127.0.0.1", port, timeout=ANSWER_SECONDS)
    encrypted = http.client.HTTPSConnection("127.0.0.1", port, timeout=ANSWER_SECONDS, context=context)
    fault: Exception | None = None
    for connection in (plain, encrypted):
        try:
            headers = {"Authorization": f"Bearer {token.text}"} if token.text else {}
            connection.request("GET", "/status", headers=headers)
            answer = connection.getresponse()
            body = answer.read(_MAX_BYTES)
        except (OSError, http.client.HTTPException) as error:
            fault = fault or error
            continue
        finally:
            connection.close()
        if answer.status == 401:
            raise BridgeError(_why_refused(port, token))
        try:
            if answer.status == 200:
                return json.loads(body)
        except ValueError:
            pass
        raise _NoBridgeError(f"port {port} is that of another program: it answered {answer.status}")
    raise _NoBridgeError(
        f"no bridge answers at port {port} of this machine ({fault}): give --port, or start one"
    )


def _why_refused(port: int, token: _Token) -> str:
    if not token.text:
        return f"the bridge at port {port} wants its token: give --token"
    if token.is_kept:
        return f"the bridge at port {port} was started with another token: give --token"
    return f"the token is not one of the bridge at port {port}: give --token as it was started with"


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 100_000 else f"{count} B"
