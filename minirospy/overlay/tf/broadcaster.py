"""tf.broadcaster, provided by minirospy: transforms as tuples to /tf. Source: http://wiki.ros.org/tf."""

from minirospy.ros.tf.tf.broadcaster import TransformBroadcaster as TransformBroadcaster
