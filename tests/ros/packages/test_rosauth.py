"""rosauth: which requests its node accepts, and with which settings it does not start."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

import pytest
import rospy
from rosauth.srv import AuthenticationRequest

from minirospy.ros.rosauth.rosauth.authentication import is_authentic, mac_of

NODE = Path(__file__).parents[3] / "msgs" / "rosauth" / "nodes" / "ros_mac_authentication"
SECRET = "abcdefghijklmnop"
NOW = rospy.Time(1000, 5)


def make(**fields: object) -> AuthenticationRequest:
    given = {"t": rospy.Time(999), "end": rospy.Time(1100), **fields}
    made = AuthenticationRequest(client="1.2.3.4", dest="5.6.7.8", rand="xyz", level="admin", **given)
    made.mac = mac_of(made, SECRET)
    return made


def test_mac_is_the_documented_one() -> None:
    text = "abcdefghijklmnop1.2.3.45.6.7.8xyz999admin1100"
    assert make().mac == hashlib.sha512(text.encode()).hexdigest()


@pytest.mark.parametrize(
    ("fields", "delta", "expected"),
    [
        ({}, 5, True),
        ({"t": rospy.Time(1004)}, 5, True),
        ({"t": rospy.Time(990)}, 5, False),
        ({"t": rospy.Time(1100)}, 5, False),
        ({"end": rospy.Time(1000, 5)}, 5, False),
        ({"t": rospy.Time(1), "end": rospy.Time(2)}, -1, True),
    ],
)
def test_time_of_a_request_counts(fields: dict[str, rospy.Time], delta: int, expected: bool) -> None:
    assert is_authentic(make(**fields), SECRET, NOW, delta) is expected


@pytest.mark.parametrize("mac", ["", "0" * 128, "é", "half"])
def test_wrong_mac_is_refused(mac: str) -> None:
    request = make()
    request.mac = request.mac[:64] if mac == "half" else mac
    assert not is_authentic(request, SECRET, NOW, 5)


@pytest.mark.parametrize("field", ["client", "dest", "rand", "level"])
def test_every_field_is_part_of_the_mac(field: str) -> None:
    request = make()
    setattr(request, field, "changed")
    assert not is_authentic(request, SECRET, NOW, 5)


@pytest.mark.parametrize(
    ("content", "status", "text"),
    [
        (None, 255, "Parameter 'secret_file_location' not found."),
        ("missing", 254, "Could not read from file '"),
        ("too short\n", 253, "Secret string not of length 16."),
    ],
)
def test_node_without_a_secret_ends(
    content: str | None, status: int, text: str, tmp_path: Path, master: str
) -> None:
    file = tmp_path / "secret"
    if content and content != "missing":
        file.write_text(content)
    words = [f"_secret_file_location:={file}"] if content else []
    done = subprocess.run(
        [sys.executable, str(NODE), *words], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == status
    assert text in done.stderr
    assert "Traceback" not in done.stderr


CLIENT = """
import rospy, sys
from rosauth.srv import Authentication
from minirospy.ros.rosauth.rosauth.authentication import mac_of

rospy.init_node("client")
call = rospy.ServiceProxy("authenticate", Authentication)
call.wait_for_service(30)
for secret in sys.argv[1:]:
    now = rospy.Time.now()
    request = Authentication._request_class(client="a", dest="b", rand="c", t=now, level="d", end=now + rospy.Duration(60))
    request.mac = mac_of(request, secret)
    print(call(request).authenticated)
"""


def test_node_answers(tmp_path: Path, master: str) -> None:
    file = tmp_path / "secret"
    file.write_text(SECRET + "\nanother line\n")
    words = [f"_secret_file_location:={file}", "_allowed_time_delta:=50"]
    node = subprocess.Popen([sys.executable, str(NODE), *words])
    try:
        done = subprocess.run(
            [sys.executable, "-c", CLIENT, SECRET, "another secret!!"],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    finally:
        node.terminate()
        node.wait(30)
    assert done.stdout == "True\nFalse\n", done.stderr
