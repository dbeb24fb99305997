"""`python benchmarks/number_lists.py`: messages with lists of numbers, compared with the floor of struct in the same run.

The floor is what Python must do in any case: `struct` packs the list, unpacks a tuple, and `min()` reads the tuple.
The values are CPU microseconds of one operation, the best of 9 batches in turns,
so other load hardly changes them. If /usr/bin/python3
has rospy, its genpy does the same in the same run, and minirospy runs in that interpreter, too.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

REAL = "/usr/bin/python3"
BATCHES = 9  # of each operation, in turns
BATCH_SECONDS = 0.02  # CPU time of a batch, far above the clock's resolution


def cases() -> dict[str, tuple[Any, struct.Struct, list[float], Callable[[Any], object]]]:
    """Return for each case its message, the struct of its numbers, the numbers, and the expression that reads the numbers."""
    from geometry_msgs.msg import Point, Point32, Polygon
    from sensor_msgs.msg import JointState, LaserScan
    from visualization_msgs.msg import Marker

    found: dict[str, tuple[Any, struct.Struct, list[float], Callable[[Any], object]]] = {}
    for size in (360, 1080):
        ranges = [1.0 + 0.01 * n for n in range(size)]
        scan = LaserScan(ranges=ranges)
        found[f"LaserScan, {size} ranges"] = (
            scan,
            struct.Struct(f"={size}f"),
            ranges,
            lambda m: min(m.ranges),
        )
    for size in (6, 30):
        values = [0.1 * n for n in range(size)]
        joints = JointState(name=[f"joint_{n}" for n in range(size)], position=values)
        found[f"JointState, {size} positions"] = (
            joints,
            struct.Struct(f"={size}d"),
            values,
            lambda m: min(m.position),
        )
    coordinates = [0.5 * n for n in range(300)]
    polygon = Polygon([Point32(*coordinates[n : n + 3]) for n in range(0, 300, 3)])
    found["Polygon, 100 points"] = (
        polygon,
        struct.Struct("=300f"),
        coordinates,
        lambda m: min([point.x for point in m.points]),
    )
    marker = Marker(points=[Point(*coordinates[n : n + 3]) for n in range(0, 300, 3)])
    found["Marker, 100 points"] = (
        marker,
        struct.Struct("=300d"),
        coordinates,
        lambda m: min([point.x for point in m.points]),
    )
    return found


def best(steps: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Return the CPU microseconds of each step, the best of some batches in turns."""
    counts, least = {}, {}
    for name, step in steps.items():
        count = 1
        while batch(step, count) < BATCH_SECONDS:
            count *= 2
        counts[name], least[name] = count, float("inf")
    for _ in range(BATCHES):
        for name, step in steps.items():
            least[name] = min(least[name], batch(step, counts[name]) / counts[name])
    return {name: 1e6 * seconds for name, seconds in least.items()}


def batch(step: Callable[[], object], count: int) -> float:
    """Return the CPU seconds of ``count`` calls."""
    start = time.process_time()
    for _ in range(count):
        step()
    return time.process_time() - start


def worker() -> dict[str, dict[str, float]]:
    """Return the times of this process's messages by case and operation."""
    results = {}
    for name, (message, numbers, values, read) in cases().items():
        buffer = io.BytesIO()
        message.serialize(buffer)
        data, raw = buffer.getvalue(), numbers.pack(*values)
        make = type(message)

        def pack(message: Any = message, buffer: io.BytesIO = buffer) -> None:
            buffer.seek(0)
            message.serialize(buffer)

        results[name] = best(
            {
                "pack": pack,
                "pack, floor": lambda numbers=numbers, values=values: numbers.pack(*values),
                "unpack and read": lambda make=make, data=data, read=read: read(make().deserialize(data)),
                "unpack and read, floor": lambda numbers=numbers, raw=raw: min(numbers.unpack(raw)),
            }
        )
    return results


def main() -> int:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    if parser.parse_args().worker:
        print(json.dumps(worker()))
        return 0
    here = Path(__file__).parents[1]
    paths = {"genpy": "", "minirospy": f"{here}:{here / 'minirospy' / 'overlay'}"}
    found = {}
    for name, path in paths.items():
        has_genpy = name == "genpy" or "genpy" in found
        done = subprocess.run(
            [REAL if has_genpy else sys.executable, __file__, "--worker"],
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode == 0:
            found[name] = json.loads(done.stdout)
        elif name == "minirospy":
            raise SystemExit(done.stderr)
    print(f"{'us':28}{'':18}{'genpy':>10}{'minirospy':>11}{'floor':>8}{'ratio to the floor':>20}")
    for case, ours in found["minirospy"].items():
        for operation in ("pack", "unpack and read"):
            real = found.get("genpy", {}).get(case, {}).get(operation, float("nan"))
            value, floor = ours[operation], ours[f"{operation}, floor"]
            print(f"{case:28}{operation:18}{real:10.1f}{value:11.1f}{floor:8.1f}{value / floor:20.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
