"""One process of a benchmark: `worker.py ROLE`. Uses only the rospy API, so it runs on any rospy."""

import json
import sys
import threading
import time

import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import UInt64
from std_srvs.srv import SetBool, SetBoolResponse


def say(**result):
    print(json.dumps(result), flush=True)


def wait_until(condition):
    end = time.monotonic() + 10
    while not condition():
        if time.monotonic() > end:
            sys.exit("the other process did not come")
        time.sleep(0.005)


def echo():
    """Sends each ping back; offers a service."""
    pong = rospy.Publisher("bench_pong", UInt64, queue_size=1, tcp_nodelay=True)
    rospy.Subscriber("bench_ping", UInt64, pong.publish, tcp_nodelay=True)
    rospy.Service("bench_service", SetBool, lambda request: SetBoolResponse(request.data, ""))
    say(ready=True)
    sys.stdin.readline()


def ping():
    """Round trips of a small message, one after the other; then service calls and parameters."""
    times = []
    done = threading.Event()
    sent = [0.0]
    count = 3000

    def on_pong(message):
        times.append(time.perf_counter() - sent[0])
        if len(times) == count:
            done.set()
        else:
            serve()

    def serve():
        sent[0] = time.perf_counter()
        publisher.publish(UInt64(len(times)))

    publisher = rospy.Publisher("bench_ping", UInt64, queue_size=1, tcp_nodelay=True)
    subscriber = rospy.Subscriber("bench_pong", UInt64, on_pong, tcp_nodelay=True)
    wait_until(lambda: publisher.get_num_connections() and subscriber.get_num_connections())
    serve()
    if not done.wait(30):
        sys.exit("a ping was lost")
    rospy.wait_for_service("bench_service", 10)
    single = rospy.ServiceProxy("bench_service", SetBool)
    persistent = rospy.ServiceProxy("bench_service", SetBool, persistent=True)
    say(
        round_trip_us=1e6 * sorted(times)[count // 2],
        service_per_s=rate(lambda: single(True)),
        persistent_service_per_s=rate(lambda: persistent(True)),
        set_param_per_s=rate(lambda: rospy.set_param("/bench", 1)),
        get_param_per_s=rate(lambda: rospy.get_param("/bench")),
    )


def rate(call, seconds=1.0):
    """How often ``call`` can be made in a second."""
    count, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        call()
        count += 1
    return count / (time.perf_counter() - start)


def talk():
    """Publishes small messages, then images, each as fast as it can for two seconds."""
    number = rospy.Publisher("bench_number", UInt64, queue_size=1000)
    image = rospy.Publisher("bench_image", Image, queue_size=2)
    wait_until(lambda: number.get_num_connections() and image.get_num_connections())
    picture = Image(height=480, width=640, step=1920, encoding="rgb8", data=bytes(921600))
    for publisher, message in ((number, UInt64(1)), (image, picture)):
        end = time.monotonic() + 2
        while time.monotonic() < end:
            publisher.publish(message)
        time.sleep(0.3)
    say(done=True)
    sys.stdin.readline()


def listen():
    """Counts what comes while it comes."""
    seen = {"bench_number": [], "bench_image": []}
    for topic, data_class in (("bench_number", UInt64), ("bench_image", Image)):
        rospy.Subscriber(
            topic, data_class, lambda m, times: times.append(time.monotonic()), callback_args=seen[topic]
        )
    say(ready=True)
    sys.stdin.readline()
    rates = {}
    for topic, times in seen.items():
        rates[topic + "_per_s"] = len(times) / max(1e-9, times[-1] - times[0]) if times else 0.0
    say(**rates)


if __name__ == "__main__":
    role = sys.argv[1]
    rospy.init_node("bench_" + role)
    if role == "start":
        say(spawn_to_node_ms=1000 * (time.monotonic() - float(sys.argv[2])))
    else:
        {"echo": echo, "ping": ping, "talk": talk, "listen": listen}[role]()
    rospy.signal_shutdown("done")
