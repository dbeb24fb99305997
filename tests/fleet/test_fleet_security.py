"""Which peers may join a fleet, and how its connections are encrypted, as set in Zenoh's configuration file."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String

from minirospy.base.errors import BridgeError
from minirospy.fleet.network import FleetNetwork, NetworkOptions
from tests.fleet.fleet import Fleet
from tests.fleet.test_fleet_gateways import collect, fleet, publisher
from tests.fleet.test_fleet_losses import gateway_of

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

__all__ = ["fleet"]


def configuration(folder: Path, name: str, **transport: Any) -> str:
    file = folder / f"{name}.json5"
    file.write_text(json.dumps({"transport": transport}))
    return str(file)


@pytest.fixture
def certificate(tmp_path: Path) -> tuple[str, str]:
    """Return the files of a self-signed certificate for localhost, and of its key."""
    if not shutil.which("openssl"):
        pytest.skip("openssl is not installed")
    key, cert = str(tmp_path / "key.pem"), str(tmp_path / "cert.pem")
    words = f"openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -keyout {key} -out {cert}"
    # A self-signed certificate must not be marked as a CA, because rustls does not accept a CA's certificate for a
    # server.
    extensions = ["-addext", "subjectAltName=DNS:localhost", "-addext", "basicConstraints=critical,CA:FALSE"]
    subprocess.run([*words.split(), *extensions], check=True, capture_output=True)
    return key, cert


def test_messages_pass_with_tls(
    fleet: Fleet, tmp_path: Path, certificate: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    key, cert = certificate
    endpoint = fleet.endpoint.replace("tcp/127.0.0.1", "tls/localhost")
    server = configuration(
        tmp_path, "server", link={"tls": {"listen_private_key": key, "listen_certificate": cert}}
    )
    client = configuration(tmp_path, "client", link={"tls": {"root_ca_certificate": cert}})
    control, robot = fleet.place(), fleet.place()
    latched = publisher(fleet, robot, "/chat", String, latch=True)
    fleet.run(latched.publish("secret"))
    gateway_of(control, "", NetworkOptions(listen=(endpoint,), config=server))
    gateway_of(robot, "robot1", NetworkOptions(connect=(endpoint,), config=client))
    found = collect(fleet, control, "/robot1/chat", String)
    fleet.until(lambda: found)
    assert found[0].data == "secret"

    monkeypatch.setattr("minirospy.zenoh.library.CONNECT_MS", 1000)
    plain = NetworkOptions(connect=(fleet.endpoint.replace("127.0.0.1", "localhost"),))
    with pytest.raises(BridgeError):
        fleet.run(FleetNetwork.open(plain, waits=False))
    stranger = NetworkOptions(connect=(endpoint,))
    with pytest.raises(BridgeError):
        fleet.run(FleetNetwork.open(stranger, waits=False))
