# ruff: noqa: BLE001
"""The connections of services as objects: TCPROSTransport, TCPROSServiceClient, a proxy's transport, _handle_request."""

import struct

import rospy
from referee import outcome, show
from rospy.impl import tcpros_service
from rospy.impl.tcpros_base import TCPROSTransport, TCPROSTransportProtocol
from rospy.impl.tcpros_service import TCPROSServiceClient, TCPService, convert_return_to_response
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger


def fields(value, *names):
    """Return an object's attributes."""
    return [getattr(value, name) for name in names]


show("# protocols")
protocol = TCPROSTransportProtocol("name", rospy.AnyMsg)
show(fields(protocol, "resolved_name", "queue_size", "buff_size", "direction"), protocol.get_header_fields())
protocol = TCPROSServiceClient("/service", SetBool, headers={"a": "b"})
show(
    fields(protocol, "resolved_name", "queue_size", "buff_size", "direction", "headers"),
    protocol.get_header_fields(),
)
show(protocol.service_class is SetBool, protocol.recv_data_class is SetBoolResponse)
protocol = TCPService("/service", SetBool)
show(protocol.get_header_fields(), protocol.recv_data_class is SetBoolRequest)

show("# a new transport")
transport = TCPROSTransport(protocol, "name")
show(fields(transport, "name", "direction", "done", "cleanup_cb", "endpoint_id", "header", "md5sum", "type", "callerid_pub",
            "dest_address", "is_latched", "latch", "local_endpoint", "remote_endpoint", "socket", "stat_bytes",
            "stat_num_msg", "transport_type"), transport.get_transport_info())  # fmt: skip
outcome("send", lambda: transport.send_message(String("x"), 1))
outcome("receive", transport.receive_once)
outcome("write", lambda: transport.write_data(b"x"))
outcome("no name", lambda: TCPROSTransport(protocol, ""))
ended = []
transport.set_cleanup_callback(lambda each: ended.append(each is transport))
try:
    transport.connect("localhost", 1, "http://x", timeout=1)
except rospy.exceptions.TransportInitError as error:
    show("refused" in str(error), transport.socket, transport.done, ended)
transport.close()
show(ended)

show("# return values")
for value in (
    SetBoolResponse(True, "x"),
    {"success": True},
    [True, "a"],
    (False, "b"),
    None,
    [True],
    5,
    {"no": 1},
):
    outcome(
        repr(value)[:12],
        lambda v=value: fields(convert_return_to_response(v, SetBoolResponse), "success", "message"),
    )

rospy.init_node("tester")
headers = []


def handle(request):
    """Fail if the request's data is false."""
    headers.append(dict(request._connection_header))
    if request.data:
        return SetBoolResponse(True, "yes")
    raise rospy.ServiceException("no")


service = rospy.Service("service", SetBool, handle)
uri = rospy.get_master().lookupService("/service")[2]
host, port = rospy.core.parse_rosrpc_uri(uri)

show("# calls")
transport = TCPROSTransport(TCPROSServiceClient("/service", SetBool, headers={"extra": "1"}), "/service")
transport.buff_size = 65536
transport.connect(host, port, uri, timeout=5)
show(
    [transport.header[name] for name in ("callerid", "md5sum", "service", "type")],
    transport.type,
    transport.md5sum,
)
show(transport.dest_address[1] == port, transport.endpoint_id == uri, transport.callerid_pub, transport.done)
transport.send_message(SetBoolRequest(True), 0)
responses = transport.receive_once()
show(
    len(responses), responses[0].message, responses[0]._connection_header["callerid"], transport.stat_num_msg
)
transport.close()
show(transport.done, transport.socket, sorted(headers[-1].items()))

transport = TCPROSTransport(TCPROSServiceClient("/service", SetBool, headers={"persistent": "1"}), "/service")
transport.connect(host, port, uri)
transport.send_message(SetBoolRequest(False), 0)
outcome("error", transport.receive_once)
transport.send_message(SetBoolRequest(True), 0)
outcome("again", lambda: [each.message for each in transport.receive_once()])
transport.close()
transport = TCPROSTransport(TCPROSServiceClient("/service", Trigger), "/service")
outcome("other type", lambda: transport.connect(host, port, uri, timeout=5))
show(transport.socket is not None, transport.done)

show("# a proxy's transport")
proxy = rospy.ServiceProxy("service", SetBool, persistent=True)
show(proxy.transport, type(proxy.protocol).__name__, proxy.protocol.headers, proxy.seq)
outcome("uri", lambda: proxy._get_service_uri(SetBoolRequest()) == uri)
outcome("no uri", lambda: rospy.ServiceProxy("none", SetBool)._get_service_uri(SetBoolRequest()))
show(proxy(True).message, type(proxy.transport).__name__, proxy.transport.done, proxy.seq, proxy.uri == uri)
show(proxy(True).message, proxy.seq, proxy.transport.dest_address[1] == port)
proxy.close()
transport = TCPROSTransport(proxy.protocol, proxy.resolved_name)
transport.buff_size = proxy.buff_size
transport.connect(host, port, uri)
proxy.transport = transport
show(proxy(True).message, proxy.transport is transport, transport.done, transport.stat_num_msg)
outcome("error", lambda: proxy(False))
show(proxy(True).message, proxy.transport is transport)
transport.connect(host, port, uri, timeout=5)
show(proxy(True).message, proxy.transport is transport)
transport.receive_once = list  # as if closed by another thread
outcome("no response", lambda: proxy(True))
proxy.transport = None
show(proxy(True).message, proxy.transport is transport, proxy.transport is None)
single = rospy.ServiceProxy("service", SetBool)
show(single(True).message, single.transport, single.seq)

show("# replaced")


def answer(self, transport, request):
    """Respond to a request, as a program's own method."""
    try:
        response = convert_return_to_response(self.handler(request), self.response_class)
        response.message += f" number {self.seq}"
        self.seq += 1
        transport.write_buff.write(struct.pack("<B", 1))
        transport.send_message(response, self.seq)
    except Exception as error:
        self._write_service_error(transport, f"mine: {error}")


service.seq = 0
before = tcpros_service.ServiceImpl._handle_request
tcpros_service.ServiceImpl._handle_request = answer
for each in (single, single, proxy, proxy):
    show(each(True).message)
    outcome("error", lambda e=each: e(False))
tcpros_service.ServiceImpl._handle_request = before
show(single(True).message, service.seq)


class Service(rospy.Service):
    """Records requests."""

    def _handle_request(self, transport, request):
        show("request", request.data)
        super()._handle_request(transport, request)


Service("other", SetBool, handle)
other = rospy.ServiceProxy("other", SetBool)
show(other(True).message)
outcome("error", lambda: other(False))
