"""tf, provided by minirospy: the older API of transforms. Source: http://wiki.ros.org/tf."""

from minirospy.ros.tf.tf import ConnectivityException as ConnectivityException
from minirospy.ros.tf.tf import Exception as Exception
from minirospy.ros.tf.tf import ExtrapolationException as ExtrapolationException
from minirospy.ros.tf.tf import LookupException as LookupException
from minirospy.ros.tf.tf import TransformBroadcaster as TransformBroadcaster
from minirospy.ros.tf.tf import Transformer as Transformer
from minirospy.ros.tf.tf import TransformerROS as TransformerROS
from minirospy.ros.tf.tf import TransformListener as TransformListener
from tf import broadcaster as broadcaster
from tf import listener as listener
from tf import transformations as transformations
