"""`python benchmarks/tf.py`: transforms, compared with Debian's tf2 if /usr/bin/python3 has it, in one run.

Lookups over a chain of five, insertion of 1,000 frames, a listener's CPU time for a TFMessage of 20 transforms, and ten
listeners at 1 kHz. Each listener looks up one transform ten times a second. All traffic is on loopback.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

from cases import BIN, free_port, wait_for_port

STACKS = {
    "minirospy": (sys.executable, [str(BIN / "roscore"), "-q", "-p"]),
    "tf2": ("/usr/bin/python3", ["/usr/bin/rosmaster", "--core", "-p"]),
}
FRAMES = 20


def stamped(parent, child, seconds, x=0.0):
    """Return a transform that includes a rotation."""
    import rospy
    from geometry_msgs.msg import TransformStamped

    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp = rospy.Time.from_sec(seconds)
    message.transform.translation.x = x
    message.transform.rotation.z, message.transform.rotation.w = 0.6, 0.8
    return message


def best_of_five(step, count):
    """Return the seconds for one step, in the best of five batches."""
    best = 1e9
    for _ in range(5):
        start = time.perf_counter()
        for _ in range(count):
            step()
        best = min(best, (time.perf_counter() - start) / count)
    return best


def measure_buffer():
    """Return the times of lookups and insertions, without a node."""
    import rospy
    import tf2_ros

    buffer = tf2_ros.Buffer(rospy.Duration(100), debug=False)
    for step in range(500):
        for hop in range(5):
            buffer.set_transform(stamped(f"f{hop}", f"f{hop + 1}", 1 + step / 100), "bench")
    times = {"latest": rospy.Time(0), "stamped": rospy.Time(3), "interpolated": rospy.Time(3, 12345678)}
    results = {
        f"lookup over five, {name}, us": best_of_five(
            lambda at=at: buffer.lookup_transform("f0", "f5", at), 2000
        ) * 1e6
        for name, at in times.items()
    }  # fmt: skip

    transforms = [stamped(f"g{n // 2}", f"g{n + 1}", 1.0) for n in range(1000)]
    again = [stamped(f"g{n // 2}", f"g{n + 1}", 2.0) for n in range(1000)]

    def insert():
        fresh = tf2_ros.Buffer(debug=False)
        for each in transforms:
            fresh.set_transform(each, "bench")
        for each in again:
            fresh.set_transform(each, "bench")

    results["insertion of 1,000 frames, ms"] = best_of_five(insert, 1) * 1e3 / 2
    return results


def listen(seconds):
    """Listen for some seconds; print the CPU time per message, and the share of a core."""
    import rospy
    import tf2_ros

    rospy.init_node("listener", anonymous=True)
    buffer = tf2_ros.Buffer(debug=False)

    class Listener(tf2_ros.TransformListener):
        count = 0

        def callback(self, data):
            self.count += 1
            super().callback(data)

    listener = Listener(buffer)
    while not buffer.can_transform("map", "link0", rospy.Time(0)):
        time.sleep(0.05)
    print("ready", flush=True)
    sys.stdin.readline()
    start, used, before = time.monotonic(), time.process_time(), listener.count
    while time.monotonic() - start < seconds:
        time.sleep(0.1)
        buffer.lookup_transform("map", "link0", rospy.Time(0))
    took, cpu, messages = time.monotonic() - start, time.process_time() - used, listener.count - before
    print(json.dumps([cpu / max(1, messages) * 1e6, cpu / took, messages / took]), flush=True)


def send(rate, transforms):
    """Publish messages with ``transforms`` transforms until stdin is closed; serialized bytes let the sender keep up."""
    import io
    import select
    import struct

    import rospy
    from tf2_msgs.msg import TFMessage

    class Bytes(TFMessage):
        __slots__ = ["data"]

        def __init__(self, data):
            self.data = data

        def serialize(self, buff):
            buff.write(self.data)

    buffer = io.BytesIO()
    TFMessage([stamped("map", f"link{n}", 4.0) for n in range(transforms)]).serialize(buffer)
    data, mark = buffer.getbuffer(), struct.pack("<2I", 4, 0)
    places, at = [], bytes(data).find(mark)
    while at >= 0:
        places.append(at)
        at = bytes(data).find(mark, at + 8)
    assert len(places) == transforms

    rospy.init_node("sender", anonymous=True)
    publisher = rospy.Publisher("/tf", Bytes, queue_size=100)
    start, count = time.monotonic(), 0
    while not select.select([sys.stdin], [], [], 0)[0]:
        now = struct.pack("<2I", *divmod(time.time_ns(), 1_000_000_000))
        for at in places:
            data[at : at + 8] = now
        publisher.publish(Bytes(bytes(data)))
        count += 1
        time.sleep(max(0.0, start + count / rate - time.monotonic()))


def measure_listeners(stack, listeners, rate, transforms, seconds):
    """Return the results for all listeners: microseconds per message, share of a core, and messages per second for each."""
    python, master = STACKS[stack]
    port = free_port()
    environment = {
        **os.environ,
        "ROS_MASTER_URI": f"http://localhost:{port}",
        "ROS_HOSTNAME": "localhost",
    }
    running = [subprocess.Popen([*master, str(port)], env=environment, stdout=subprocess.DEVNULL)]

    def start(interpreter, *arguments):
        program = subprocess.Popen(
            [interpreter, __file__, *map(str, arguments)],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        running.append(program)
        return program

    try:
        wait_for_port(port)
        # Use the same sender for both, because real rospy's reaches only a quarter of this rate.
        start(sys.executable, "--send", rate, transforms)
        programs = [start(python, "--listen", seconds) for _ in range(listeners)]
        for program in programs:
            assert program.stdout.readline() == "ready\n"
        for program in programs:
            program.stdin.write("go\n")
            program.stdin.flush()
        figures = [json.loads(program.stdout.readline()) for program in programs]
    finally:
        for program in reversed(running):
            program.terminate()
            try:
                program.wait(5)
            except subprocess.TimeoutExpired:
                program.kill()
                program.wait()
    each, share, frequency = zip(*figures, strict=True)
    return sum(each) / len(each), sum(share), min(frequency)


def main():
    """Print each result of both, and the ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--buffer", action="store_true", help="only what needs no node, of this interpreter, as JSON"
    )
    parser.add_argument("--listen", type=float, metavar="SECONDS", help="be a listener")
    parser.add_argument("--send", nargs=2, type=float, metavar=("RATE", "TRANSFORMS"), help="be a sender")
    parser.add_argument("--one", action="store_true", help="only one listener")
    parser.add_argument("--seconds", type=float, default=8.0, help="how long listeners are measured (8)")
    options = parser.parse_args()
    if options.buffer:
        print(json.dumps(measure_buffer()))
        return
    if options.listen:
        listen(options.listen)
        return
    if options.send:
        send(options.send[0], int(options.send[1]))
        return

    stacks = [stack for stack, (python, _) in STACKS.items() if Path(python).exists()]
    table = {}
    for stack in stacks:
        done = subprocess.run(
            [STACKS[stack][0], __file__, "--buffer"], capture_output=True, text=True, check=True
        )
        for name, value in json.loads(done.stdout).items():
            table.setdefault(name, {})[stack] = value
    scenes = [(1, 200, FRAMES), (1, 1000, FRAMES), (10, 1000, 1), (10, 1000, FRAMES)]
    for listeners, rate, transforms in scenes[: 2 if options.one else None]:
        for stack in stacks:
            each, share, frequency = measure_listeners(stack, listeners, rate, transforms, options.seconds)
            name = f"{listeners} listening, {rate} Hz x {transforms}"
            table.setdefault(f"{name}: us CPU a message", {})[stack] = each
            table.setdefault(f"{name}: cores together", {})[stack] = share
            table.setdefault(f"{name}: Hz received", {})[stack] = frequency

    print(f"{'':50}" + "".join(f"{stack:>14}" for stack in stacks) + f"{'ratio':>8}")
    for name, figures in table.items():
        ratio = f"{figures['minirospy'] / figures['tf2']:8.2f}" if "tf2" in figures else ""
        print(f"{name:50}" + "".join(f"{figures[stack]:14.3f}" for stack in stacks) + ratio)


if __name__ == "__main__":
    main()
