"""`make ros2`: install two independent implementations of rmw_zenoh's protocol from PyPI in build/zenoh-peers.

They are not rmw_zenoh itself, which is not on PyPI. If they are not available, print one line; the tests are then skipped.
"""

from __future__ import annotations

import os
import subprocess
import sys

from tests.interop.environments import PeerEnvironment

PACKAGES = (
    "pyzeros==0.1.0",
    "zenoh-ros2-sdk==0.1.8",
    "ros2-pyterfaces==0.3.0",
    "rosbags==0.11.9",
    "eclipse-zenoh==1.10.2",
)
PEER = PeerEnvironment("zenoh-peers", PACKAGES)
PYTHON, STAMP = PEER.python, PEER.stamp
CACHE = PEER.folder / "cydr"


def main() -> int:
    """Install; always return 0, because the tests are skipped if the installation fails."""
    if PEER.is_complete:
        return 0
    if not PEER.create():
        print(
            "pyzeros and zenoh-ros2-sdk cannot be installed here: the bridge over Zenoh is not tested against them"
        )
        return 0
    # pyzeros compiles its attachments' serializer on first use, which takes minutes on a busy machine.
    code = "from pyzeros.builtin_msgs import Attachment; Attachment().serialize()"
    environment = {**os.environ, "CYDR_CACHE_DIR": str(CACHE)}
    if subprocess.run(
        [str(PYTHON), "-c", code], env=environment, capture_output=True, check=False
    ).returncode:
        print("pyzeros does not work here: the bridge over Zenoh is not tested against it")
        return 0
    PEER.complete()
    return 0


if __name__ == "__main__":
    sys.exit(main())
