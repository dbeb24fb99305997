"""tf.listener, provided by minirospy: lookups as tuples. Source: http://wiki.ros.org/tf."""

from minirospy.ros.tf.tf.listener import Transformer as Transformer
from minirospy.ros.tf.tf.listener import TransformerROS as TransformerROS
from minirospy.ros.tf.tf.listener import TransformListener as TransformListener
from minirospy.ros.tf.tf.listener import strip_leading_slash as strip_leading_slash
from minirospy.ros.tf.tf.listener import xyz_to_mat44 as xyz_to_mat44
from minirospy.ros.tf.tf.listener import xyzw_to_mat44 as xyzw_to_mat44
