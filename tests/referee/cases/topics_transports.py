"""rospy.impl.transport: the base classes of connections, which programs derive from."""

from referee import outcome, show
from rosbag.bag import _IndexEntry, _IndexEntry102, _IndexEntry200
from rospy import Time
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.transport import INBOUND, DeadTransport, ProtocolHandler, Transport


def fields(value):
    return sorted((name, each) for name, each in vars(value).items() if name != "id")


one, two = Transport(INBOUND, "name"), Transport("b")
show(fields(one), two.name, two.id - one.id, one.transport_type)
outcome("write", lambda: one.write_data(b""))
outcome("info", one.get_transport_info)
outcome("fileno", one.fileno)
closed = []
one.set_cleanup_callback(closed.append)
one.close()
show(closed == [one], one.done)
one.close()
show(len(closed))
dead = DeadTransport(one)
show(fields(dead), dead.transport_type, dead.get_transport_info(), dead.id == one.id)
handler = ProtocolHandler()
outcome("create", lambda: handler.create_transport("topic", "uri", ["TCPROS"]))
outcome("publisher", lambda: handler.init_publisher("topic", ["TCPROS"]))
show(
    handler.get_supported(),
    handler.supports("TCPROS"),
    handler.shutdown(),
    issubclass(TCPROSTransport, Transport),
)

show("# index entries of bags")
old, new = _IndexEntry102(Time(1), 5), _IndexEntry200(Time(2), 7, 9)
show(old.position, new.position, old.time, new.chunk_pos, new.offset, old < new, isinstance(new, _IndexEntry))
