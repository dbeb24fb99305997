"""A node that runs on rospy or minirospy; the first argument selects its role.

talk     publish one message of each kind, latched, until stdin is closed
listen   print "kind digest" of one message of each kind, and exit
serve    offer /set_flag (std_srvs/SetBool) until stdin is closed
call     call /set_flag with True and False, print the responses, and exit
"""

import sys
import threading
import zlib
from io import BytesIO

import rospy
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import Bool, String
from std_srvs.srv import SetBool, SetBoolResponse


def messages():
    """Return one message of each kind, with every field filled."""
    scan = LaserScan(angle_min=-2.4, angle_max=2.4, angle_increment=0.003, range_min=0.1, range_max=40.0)
    scan.header.stamp = rospy.Time(1234567890, 987654321)
    scan.header.frame_id = "scan"
    scan.ranges = [0.1 * i for i in range(1651)]
    scan.intensities = [255.0 - (i % 256) for i in range(1651)]
    image = Image(height=1080, width=1920, encoding="rgb8", step=3 * 1920, data=bytes(range(256)) * 24300)
    image.header.frame_id = "camera"
    return {"bool": Bool(True), "string": String("zażółć ]]> gęślą"), "scan": scan, "image": image}


KINDS = {"bool": Bool, "string": String, "scan": LaserScan, "image": Image}


def digest(message):
    """Return the length and CRC-32 of the message's bytes, excluding the sequence number, which the publisher sets."""
    if hasattr(message, "header"):
        message.header.seq = 0
    buffer = BytesIO()
    message.serialize(buffer)
    return f"{buffer.tell()}-{zlib.crc32(buffer.getvalue()):08x}"


def say(*words):
    """Print a line with a single write, because the callbacks of several topics run concurrently."""
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


def talk():
    for kind, message in messages().items():
        publisher = rospy.Publisher("/interop/" + kind, KINDS[kind], latch=True, queue_size=1)
        publisher.publish(message)
        say(kind, digest(message))
    say("ready")
    sys.stdin.read()


def listen():
    left = set(KINDS)
    done = threading.Event()

    def on_message(message, kind):
        say(kind, digest(message))
        left.discard(kind)
        if not left:
            done.set()

    for kind, data_class in KINDS.items():
        rospy.Subscriber("/interop/" + kind, data_class, on_message, callback_args=kind)
    if not done.wait(150):
        sys.exit("nothing came of: " + ", ".join(sorted(left)))


def serve():
    rospy.Service(
        "/set_flag", SetBool, lambda request: SetBoolResponse(request.data, "flag: " + str(request.data))
    )
    say("ready")
    sys.stdin.read()


def call():
    rospy.wait_for_service("/set_flag", timeout=150)
    for persistent in (False, True):
        proxy = rospy.ServiceProxy("/set_flag", SetBool, persistent=persistent)
        for flag in (True, False):
            response = proxy(flag)
            say(response.success, response.message)


if __name__ == "__main__":
    role = sys.argv[1]
    rospy.init_node("peer_" + role)
    {"talk": talk, "listen": listen, "serve": serve, "call": call}[role]()
    rospy.signal_shutdown("done")
