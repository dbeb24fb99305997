"""rospy.service, filled in by minirospy."""

import logging

from minirospy.client.manager import ServiceManager as ServiceManager
from minirospy.client.services import Service as Service
from minirospy.client.services import ServiceProxy as ServiceProxy
from minirospy.errors import ServiceException as ServiceException
from rospy import core as _core
from rospy.impl.passing import passing_on
from rospy.impl.registration import Registration as Registration
from rospy.impl.transport import BIDIRECTIONAL as BIDIRECTIONAL
from rospy.impl.transport import INBOUND as INBOUND
from rospy.impl.transport import OUTBOUND as OUTBOUND

logger = logging.getLogger("rospy.service")
__getattr__, __dir__ = passing_on(__name__, _core)
