"""`python benchmarks/messages.py`: serialization of messages, compared with real genpy if /usr/bin/python3 has it.

It also measures the compiler from definitions to Python modules, and the time to import these.
"""

import io
import json
import subprocess
import sys
import time

REAL = "/usr/bin/python3"


def samples():
    """Return messages by name, such as robots send them."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
    from geometry_msgs.msg import Pose, PoseArray, TransformStamped
    from sensor_msgs.msg import Image, JointState, LaserScan
    from std_msgs.msg import Bool, String
    from tf2_msgs.msg import TFMessage

    scan = LaserScan(ranges=[1 + 0.01 * i for i in range(1651)], intensities=[100.0 + i for i in range(1651)])
    joints = JointState(
        name=[f"joint_{i}" for i in range(6)], position=[0.1] * 6, velocity=[0.2] * 6, effort=[0.3] * 6
    )
    poses = PoseArray(poses=[Pose() for _ in range(100)])
    transforms = TFMessage(transforms=[TransformStamped(child_frame_id=f"link_{i}") for i in range(20)])
    status = [
        DiagnosticStatus(
            0, f"device {i}", "all is well", f"hw-{i}", [KeyValue(f"key_{k}", f"{k}") for k in range(10)]
        )
        for i in range(20)
    ]
    return {
        "Bool": Bool(True),
        "String, 32 letters": String("x" * 32),
        "JointState, 6": joints,
        "LaserScan, 1651": scan,
        "Image, VGA": Image(data=bytes(640 * 480 * 3)),
        "PoseArray, 100": poses,
        "TFMessage, 20": transforms,
        "DiagnosticArray, 20 x 10": DiagnosticArray(status=status),
    }


def seconds(step):
    """Return the time for one step: the best of five batches."""
    count = 1
    while True:
        start = time.perf_counter()
        for _ in range(count):
            step()
        took = time.perf_counter() - start
        if took > 0.05:
            break
        count *= 2
    best = took
    for _ in range(4):
        start = time.perf_counter()
        for _ in range(count):
            step()
        best = min(best, time.perf_counter() - start)
    return best / count


def worker():
    """Return the times of this process's messages, in microseconds."""
    figures = {}
    for name, message in samples().items():
        buffer, data_class = io.BytesIO(), type(message)

        def write(message=message, buffer=buffer):
            buffer.seek(0)
            message.serialize(buffer)

        write()
        data = buffer.getvalue()
        figures[f"{name}: serialize"] = 1e6 * seconds(write)
        figures[f"{name}: deserialize"] = 1e6 * seconds(lambda c=data_class, d=data: c().deserialize(d))
    print(json.dumps(figures))


def compiler():
    """Return the milliseconds to compile all of msgs/ in memory, and to import a package of messages in a new process."""
    from pathlib import Path

    from minirospy.core.idl.load import Catalogue, compile_package

    start = time.perf_counter()
    catalogue = Catalogue.below(Path(__file__).parents[1] / "msgs")
    modules = sum(len(compile_package(catalogue, package)) for package in catalogue.packages)
    took = time.perf_counter() - start
    print(f"compiling {modules} modules of msgs/: {1000 * took:.0f} ms")
    code = "import time; t = time.perf_counter(); import sensor_msgs.msg; print(1000 * (time.perf_counter() - t))"
    for python in (sys.executable, REAL):
        done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
        if done.returncode == 0:
            print(f"import sensor_msgs.msg by {python}: {float(done.stdout):.0f} ms")


def main():
    if sys.argv[1:] == ["worker"]:
        worker()
        return
    results = {}
    for name, python in (("genpy", REAL), ("minirospy", sys.executable)):
        done = subprocess.run([python, __file__, "worker"], capture_output=True, text=True, check=False)
        if done.returncode == 0:
            results[name] = json.loads(done.stdout)
    print(
        f"{'microseconds':40}"
        + "".join(f"{name:>12}" for name in results)
        + "       ratio" * (len(results) == 2)
    )
    for case, ours in results["minirospy"].items():
        line = f"{case:40}" + "".join(f"{figures[case]:12.2f}" for figures in results.values())
        print(line + (f"{results['genpy'][case] / ours:12.1f}" if len(results) == 2 else ""))
    compiler()


if __name__ == "__main__":
    main()
