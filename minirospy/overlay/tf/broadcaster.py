"""tf.broadcaster, provided by minirospy: transforms as tuples to /tf. Source: http://wiki.ros.org/tf."""

from minirospy.compat.tf.broadcaster import TransformBroadcaster as TransformBroadcaster
