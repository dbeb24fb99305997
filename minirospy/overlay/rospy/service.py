"""rospy.service, provided by minirospy."""

from minirospy.base.errors import ServiceException as ServiceException
from minirospy.client.services import Service as Service
from minirospy.client.services import ServiceProxy as ServiceProxy
from minirospy.ros.rospy.rospy.core import service_logger as logger
from minirospy.ros.rospy.rospy.impl.registration import ServiceManager as ServiceManager
from minirospy.ros.rospy.rospy.passing import service_dir as __dir__
from minirospy.ros.rospy.rospy.passing import service_getattr as __getattr__
from rospy.impl.registration import Registration as Registration
from rospy.impl.transport import BIDIRECTIONAL as BIDIRECTIONAL
from rospy.impl.transport import INBOUND as INBOUND
from rospy.impl.transport import OUTBOUND as OUTBOUND
