"""Calls that a shutdown ends: of the client's node, of the server's node, of the service only."""

import rospy
from referee import Other, show

SERVER = """
import sys, threading
import rospy
from std_srvs.srv import Trigger, TriggerResponse
rospy.init_node("server")
gate = threading.Event()
def handle(request):
    print("called", flush=True)
    gate.wait(30)
    return TriggerResponse(True, "late")
service = rospy.Service("/slow", Trigger, handle)
print("ready", flush=True)
threading.Thread(target=lambda: (service.spin(), print("spun", rospy.is_shutdown(), flush=True)), daemon=True).start()
for line in sys.stdin:
    exec(line)
"""
CLIENT = """
import rospy, threading, sys
from std_srvs.srv import Trigger
rospy.init_node("client")
def call():
    try:
        print("gives", rospy.ServiceProxy("/slow", Trigger, persistent=sys.argv[1] == "1")(), flush=True)
    except Exception as error:
        print("raises", type(error).__name__, "|", error, flush=True)
thread = threading.Thread(target=call)
thread.start()
thread.join()
print("shut down", rospy.is_shutdown(), flush=True)
"""


def tell(server, line):
    server.process.stdin.write(line + "\n")
    server.process.stdin.flush()


rospy.init_node("case", argv=[])
for how in (
    "server.process.kill()",
    "tell(server, 'rospy.signal_shutdown(1)')",
    "tell(server, 'service.shutdown()')",
):
    for persistent in ("0", "1"):
        server = Other(SERVER)
        server.read()
        client = Other(CLIENT, persistent)
        show(how, "persistent", persistent, "|", server.read())
        exec(how)
        tell_gate = not how.startswith("server")
        if tell_gate:
            show("  server", server.read())
            tell(server, "gate.set()")
        show("  client", client.read())
        show("  client", client.read())
        client.close()
        server.close()
