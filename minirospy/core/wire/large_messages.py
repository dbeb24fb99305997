"""The text in getBusInfo that states how a publisher sent large messages to a subscriber.

It is not part of :mod:`minirospy.core.wire.ring`, because every program imports it, and `import rospy` must be fast.
"""

from __future__ import annotations

import re
from typing import NamedTuple

__all__ = ["LargeMessages", "parse_large_messages"]

# Matches a suffix of a connection's description in getBusInfo. Limits length and characters, as the peer wrote the text
_LARGE_MESSAGES = r"; (\d{1,18}) of (\d{1,18}) large messages by shared memory(?:: ([ -~]{1,200}))?\Z"


class LargeMessages(NamedTuple):
    """A connection's large messages: how many went through a ring, and why the others did not ("" if most did)."""

    shared: int
    all: int
    why: str = ""

    @property
    def text(self) -> str:
        """The suffix for a connection's description in getBusInfo; :func:`parse_large_messages` reads it."""
        return f"; {self.shared} of {self.all} large messages by shared memory" + (
            f": {self.why}" if self.why else ""
        )


def parse_large_messages(info: str) -> LargeMessages | None:
    """Parse the suffix of a connection's description in getBusInfo. Return None if it does not mention large messages."""
    match = re.search(_LARGE_MESSAGES, info)
    return LargeMessages(int(match[1]), int(match[2]), match[3] or "") if match else None
