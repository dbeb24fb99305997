"""tf, the older API: transformers, listeners and broadcasters, based on tf2's buffer.

A leading slash in a frame name is removed, because tf2 rejects it. Source: http://wiki.ros.org/tf.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.base.errors import ConnectivityException, ExtrapolationException, LookupException
from minirospy.base.errors import TransformException as Exception
from minirospy.ros.tf.tf.broadcaster import TransformBroadcaster
from minirospy.ros.tf.tf.listener import Transformer, TransformerROS, TransformListener

if TYPE_CHECKING:
    from minirospy.ros.tf.tf import broadcaster, listener, transformations

__all__ = [
    "ConnectivityException",
    "Exception",
    "ExtrapolationException",
    "LookupException",
    "TransformBroadcaster",
    "TransformListener",
    "Transformer",
    "TransformerROS",
    "broadcaster",
    "listener",
    "transformations",
]
