"""`minirospy bridge --status`: what a running bridge serves, and to whom."""

from __future__ import annotations

import json
from typing import Any

from minirospy.errors import BridgeError

__all__ = ["show_status"]

_SECONDS = 5.0
_MOST_BYTES = 10_000_000


def show_status(port: int, token: str, *, as_json: bool) -> int:
    """Print the status of the bridge at a port of this machine; return the exit status. Raises BridgeError."""
    found = _fetch(port, token)
    if as_json:
        print(json.dumps(found, indent=1))
        return 0

    print(f"node [{found['node']}], for {found['seconds']:.0f} s")
    for name, door in found["doors"].items():
        scheme = "wss" if door["encrypted"] else "ws"
        refused = f", {door['refused']} refused" if door["refused"] else ""
        print(
            f"{name}: {scheme}://{door['address']}:{door['port']}, {door['connections']} connections{refused}"
        )
    print(f"{len(found['topics'])} topics subscribed")
    for client in found["clients"]:
        print(
            f" * {client['address']} ({client['door']}, {client['rights']}, {client['seconds']:.0f} s): "
            f"{client['sent']} messages sent ({_size(client['sent_bytes'])}), {client['dropped']} dropped, "
            f"{client['waiting']} waiting ({_size(client['waiting_bytes'])}), {client['received']} received"
        )
    return 0


def _fetch(port: int, token: str) -> Any:
    """Return the JSON of the status page."""
    import http.client
    import ssl

    from minirospy.bridge.tokens import read_tokens
    from minirospy.environment import Environment

    if not token:
        kept = read_tokens(Environment.read().home)
        token = kept.read if kept else ""
    # Of this machine: whose certificate it is does not matter.
    context = ssl._create_unverified_context()
    plain = http.client.HTTPConnection("127.0.0.1", port, timeout=_SECONDS)
    encrypted = http.client.HTTPSConnection("127.0.0.1", port, timeout=_SECONDS, context=context)
    fault: Exception | None = None
    for connection in (plain, encrypted):
        try:
            connection.request(
                "GET", "/status", headers={"Authorization": f"Bearer {token}"} if token else {}
            )
            answer = connection.getresponse()
            body = answer.read(_MOST_BYTES)
        except (OSError, http.client.HTTPException) as error:
            fault = fault or error
            continue
        finally:
            connection.close()
        if answer.status == 401:
            why = (
                f"the token is not one of the bridge at port {port}"
                if token
                else f"the bridge at port {port} wants its token"
            )
            raise BridgeError(f"{why}: give --token")
        try:
            if answer.status == 200:
                return json.loads(body)
        except ValueError:
            pass
        raise BridgeError(f"port {port} is that of another program: it answered {answer.status}")
    raise BridgeError(
        f"no bridge answers at port {port} of this machine ({fault}): give --port, or start one"
    )


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 100_000 else f"{count} B"
