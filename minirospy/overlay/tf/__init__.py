"""tf, provided by minirospy: the older API of transforms. Source: http://wiki.ros.org/tf."""

from minirospy.compat.tf import ConnectivityException as ConnectivityException
from minirospy.compat.tf import Exception as Exception
from minirospy.compat.tf import ExtrapolationException as ExtrapolationException
from minirospy.compat.tf import LookupException as LookupException
from minirospy.compat.tf import TransformBroadcaster as TransformBroadcaster
from minirospy.compat.tf import Transformer as Transformer
from minirospy.compat.tf import TransformerROS as TransformerROS
from minirospy.compat.tf import TransformListener as TransformListener
from tf import broadcaster as broadcaster
from tf import listener as listener
from tf import transformations as transformations
