"""The node ros_mac_authentication, whose service ``authenticate`` checks that a client knows a secret.

Parameters: ~secret_file_location (a file with 16 characters), ~allowed_time_delta (5 seconds; negative: no limit).
Source: http://wiki.ros.org/rosauth, http://wiki.ros.org/rosauth/Tutorials/Authenticating%20a%20ROS%20Connection.
"""

from __future__ import annotations

import hashlib
import hmac
from pathlib import Path

from rosauth.srv import Authentication, AuthenticationRequest, AuthenticationResponse

from minirospy import client as rospy
from minirospy.base import times

__all__ = ["is_authentic", "mac_of", "main"]

SECRET_LENGTH = 16
_SECRET_FILE = "secret_file_location"
# ROS's node returns -1, -2 and -3, which become these exit statuses.
_NO_PARAMETER, _NO_FILE, _NO_SECRET = 255, 254, 253


def main() -> int:
    """Run the node; return 255 if the parameter is missing, 254 if the file is missing, 253 if the secret is invalid."""
    rospy.init_node("ros_mac_authentication")
    file = rospy.get_param(f"~{_SECRET_FILE}", None)
    if not isinstance(file, str):
        rospy.logerr(f"Parameter '{_SECRET_FILE}' not found.")
        return _NO_PARAMETER
    try:
        secret = Path(file).read_text(encoding="utf-8", errors="surrogateescape").partition("\n")[0]
    except OSError:
        rospy.logerr(f"Could not read from file '{file}'")
        return _NO_FILE
    if len(secret) != SECRET_LENGTH:
        rospy.logerr(f"Secret string not of length {SECRET_LENGTH}.")
        return _NO_SECRET

    delta = rospy.get_param("~allowed_time_delta", 5)
    if isinstance(delta, bool) or not isinstance(delta, (int, float)):
        rospy.logerr(
            f"Parameter 'allowed_time_delta' is not a number of seconds: {delta!r}. It is 5 instead."
        )
        delta = 5

    def answer(request: AuthenticationRequest) -> AuthenticationResponse:
        return AuthenticationResponse(is_authentic(request, secret, rospy.Time.now(), delta))

    service = rospy.Service("authenticate", Authentication, answer)
    rospy.loginfo("ROS Authentication Server Started")
    rospy.spin()
    del service
    return 0


def mac_of(request: AuthenticationRequest, secret: str) -> str:
    """Compute a request's MAC with the secret: a SHA-512 hash in hexadecimal."""
    text = f"{secret}{request.client}{request.dest}{request.rand}{request.t.secs}{request.level}{request.end.secs}"
    return hashlib.sha512(text.encode("utf-8", "surrogateescape")).hexdigest()


def is_authentic(request: AuthenticationRequest, secret: str, now: times.Time, allowed_delta: float) -> bool:
    """Return whether a request has the correct MAC, is recent and has not expired.

    If ``allowed_delta`` is negative, check only the MAC.
    """
    is_in_time = allowed_delta < 0 or (abs(request.t - now).secs < allowed_delta and request.end > now)
    mac = request.mac.encode("utf-8", "surrogateescape")
    return is_in_time and hmac.compare_digest(mac, mac_of(request, secret).encode("ascii"))
