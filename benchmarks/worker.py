"""One process of a benchmark: `worker.py ROLE name=value ...`. It uses only the rospy API, so it runs on any rospy.

A worker prints a line of JSON when it is ready, one when it has measured, and one with its cost at the
end; it reads the lines "go" and "stop" from stdin.
"""

import json
import sys
import threading
import time

SCAN_POINTS = 1651
CLOUD_POINTS = 65_536
CLOUD_STEP = 16  # bytes per point: x, y, z, intensity
IMAGES = {"vga": (640, 480), "6mb": (1920, 1080)}


def say(**result):
    print(json.dumps(result), flush=True)


def heard(word):
    """Wait for a line; exit if the driver has exited."""
    for line in sys.stdin:
        if line.strip() == word:
            return
    sys.exit("the driver is gone")


def wait_until(condition):
    end = time.monotonic() + 20
    while not condition():
        if time.monotonic() > end:
            sys.exit("the others did not come")
        time.sleep(0.005)


def stop(cpu_start):
    heard("stop")
    say(cpu=time.process_time() - cpu_start)


def start(options):
    import rospy

    rospy.init_node("bench_start")
    say(ms=1000 * (time.monotonic() - float(options["start_time"])))


def message_of(kind):
    if kind == "small":
        from std_msgs.msg import UInt64

        return UInt64()
    if kind == "scan":
        from sensor_msgs.msg import LaserScan

        scan = LaserScan(range_max=40.0, angle_increment=4.8 / SCAN_POINTS)
        scan.ranges = [1.0 + 0.01 * point for point in range(SCAN_POINTS)]
        scan.intensities = [100.0 + point for point in range(SCAN_POINTS)]
        return scan
    if kind == "cloud":
        from sensor_msgs.msg import PointCloud2, PointField

        return PointCloud2(
            height=1,
            width=CLOUD_POINTS,
            fields=[PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyzi")],
            point_step=CLOUD_STEP,
            row_step=CLOUD_STEP * CLOUD_POINTS,
            data=bytes(CLOUD_STEP * CLOUD_POINTS),
            is_dense=True,
        )
    from sensor_msgs.msg import Image

    width, height = IMAGES[kind]
    return Image(height=height, width=width, encoding="rgb8", step=3 * width, data=bytes(3 * width * height))


def reader_of(kind):
    """Return a function that reads a message like a typical callback."""
    if kind == "small":
        return lambda message: message.data
    if kind == "scan":
        return lambda message: min(message.ranges)
    if kind == "cloud":
        return read_cloud
    return lambda message: (len(message.data), message.data[-1])


def read_cloud(message):
    """Return the greatest z of a cloud's points, from an array in the steps of ros_numpy's pointcloud2_to_array."""
    import numpy

    dtype = numpy.dtype(
        {
            "names": [field.name for field in message.fields],
            "formats": ["<f4"] * len(message.fields),
            "offsets": [field.offset for field in message.fields],
            "itemsize": message.point_step,
        }
    )
    cloud = numpy.frombuffer(message.data, dtype).reshape(message.height, message.width)
    return cloud["z"].max()


def talk(options):
    """Publish one kind of message, as fast as possible or ``hz`` times a second."""
    import rospy

    rospy.init_node("bench_talker")
    kind, hz, seconds = options["kind"], float(options["hz"]), float(options["seconds"])
    message = message_of(kind)
    publisher = rospy.Publisher("bench", type(message), queue_size=1000 if kind in ("small", "scan") else 2)
    wait_until(lambda: publisher.get_num_connections() >= int(options["listeners"]))
    say(ready=True)
    heard("go")
    cpu_start, due = time.process_time(), time.monotonic()
    end, published = due + seconds, 0
    while time.monotonic() < end:
        if hz:
            due += 1 / hz
            time.sleep(max(0.0, due - time.monotonic()))
            if kind == "small":
                message.data = time.monotonic_ns()
            else:
                message.header.stamp = rospy.Time.from_sec(time.time())
        publisher.publish(message)
        published += 1
    say(published=published)
    stop(cpu_start)


def listen(options):
    """Count the messages that arrive, and their delay."""
    import rospy

    rospy.init_node("bench_listener_" + options["id"])
    kind, paced, seconds = options["kind"], float(options["hz"]), float(options["seconds"])
    read = reader_of(kind)
    count, late = [0], []

    if kind == "cloud":
        import numpy  # noqa: F401 - before the first message arrives

    def on_message(message):
        if kind == "cloud":
            read(message)  # the delay includes the reading
        if paced and kind == "small":
            late.append((time.monotonic_ns() - message.data) / 1000)
        elif paced:
            late.append(1e6 * (time.time() - message.header.stamp.to_sec()))
        if kind != "cloud":
            read(message)
        count[0] += 1

    rospy.Subscriber("bench", type(message_of(kind)), on_message, tcp_nodelay=bool(paced))
    say(ready=True)
    heard("go")
    cpu_start = time.process_time()
    wait_until(lambda: count[0])
    start, before = time.monotonic(), count[0]
    time.sleep(seconds)
    per_second = (count[0] - before) / (time.monotonic() - start)
    seen = -1
    while seen != count[0]:
        seen = count[0]
        time.sleep(0.5)
    say(per_s=per_second, delivered=seen, late_us=late)
    stop(cpu_start)


def echo(_options):
    """Send each ping back."""
    import rospy
    from std_msgs.msg import UInt64

    rospy.init_node("bench_echo")
    pong = rospy.Publisher("bench_pong", UInt64, queue_size=1)
    rospy.Subscriber("bench_ping", UInt64, pong.publish, tcp_nodelay=True)
    say(ready=True)
    heard("go")
    stop(time.process_time())


def ping(options):
    """Measure round trips of a small message; the callback for each pong sends the next ping."""
    import rospy
    from std_msgs.msg import UInt64

    rospy.init_node("bench_ping")
    times, sent, done = [], [0], threading.Event()
    count = int(options["count"])
    ball = UInt64()

    def serve():
        sent[0] = time.perf_counter_ns()
        publisher.publish(ball)

    def on_pong(_message):
        times.append((time.perf_counter_ns() - sent[0]) / 1000)
        if len(times) == count:
            done.set()
        else:
            serve()

    publisher = rospy.Publisher("bench_ping", UInt64, queue_size=1)
    subscriber = rospy.Subscriber("bench_pong", UInt64, on_pong, tcp_nodelay=True)
    wait_until(lambda: publisher.get_num_connections() and subscriber.get_num_connections())
    say(ready=True)
    heard("go")
    cpu_start = time.process_time()
    serve()
    if not done.wait(60):
        sys.exit("a ping was lost")
    say(us=times[count // 10 :])
    stop(cpu_start)


def serve(_options):
    """Offer a service, and publish a latched message."""
    import rospy
    from std_msgs.msg import UInt64
    from std_srvs.srv import SetBool, SetBoolResponse

    rospy.init_node("bench_server")
    rospy.Service("bench_service", SetBool, lambda request: SetBoolResponse(request.data, "ok"))
    publisher = rospy.Publisher("bench_latched", UInt64, queue_size=1, latch=True)
    publisher.publish(UInt64(7))
    say(ready=True)
    heard("go")
    stop(time.process_time())


def call(options):
    """Measure service calls, parameters, and how long a new Subscriber waits for a latched message."""
    import rospy
    from std_msgs.msg import UInt64
    from std_srvs.srv import SetBool

    rospy.init_node("bench_client")
    rospy.wait_for_service("bench_service", 20)
    single = rospy.ServiceProxy("bench_service", SetBool)
    persistent = rospy.ServiceProxy("bench_service", SetBool, persistent=True)
    seconds = float(options["seconds"])

    def discover():
        got = threading.Event()
        start = time.perf_counter()
        subscriber = rospy.Subscriber("bench_latched", UInt64, lambda message: got.set())
        if not got.wait(10):
            sys.exit("no latched message")
        took = time.perf_counter() - start
        subscriber.unregister()
        time.sleep(0.02)
        return 1000 * took

    say(ready=True)
    heard("go")
    cpu_start = time.process_time()
    say(
        single=rate(lambda: single(True), seconds),
        persistent=rate(lambda: persistent(True), seconds),
        set_param=rate(lambda: rospy.set_param("/bench", 1), seconds),
        get_param=rate(lambda: rospy.get_param("/bench"), seconds),
        discovery_ms=sorted(discover() for _ in range(21))[10],
    )
    stop(cpu_start)


def rate(step, seconds):
    """Return how often ``step`` runs in a second."""
    for _ in range(20):
        step()
    count, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        step()
        count += 1
    return count / (time.perf_counter() - start)


if __name__ == "__main__":
    roles = (start, talk, listen, echo, ping, serve, call)
    {role.__name__: role for role in roles}[sys.argv[1]](dict(word.split("=", 1) for word in sys.argv[2:]))
    sys.modules["rospy"].signal_shutdown("done")
