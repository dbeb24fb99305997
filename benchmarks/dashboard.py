"""`PYTHONPATH=. python benchmarks/dashboard.py [page] [scene] [clients] [soak]`: the page's frame rate, and its server's cost.

page: headless chromium shows a layout with an image of 640x480 RGB at 30 Hz, ten plots of a scan of 1651 beams at 33 Hz, and
the topics with the scan open; measures frames per second with requestAnimationFrame.

scene: headless chromium shows an arm whose joints move at 50 Hz and a scan of 720 readings at 10 Hz in the 3D view, while the
camera turns, so that each animation frame needs a picture; measures the time of the page's JavaScript for a picture, draw calls,
triangles and the bytes uploaded to the graphics card. Chromium draws in software by default; with --gpu it draws on the
graphics card, and the frames per second are those of a user.

clients: ten programs use the page's protocol on 50 topics at a raised rate; measures the memory of the server and of a client
over the run, and the server's CPU time for each MB that it sends.

soak: ten such clients and two pages in chromium receive 50 topics, a scan, moving frames, images and log lines, all at a raised
rate of 100 Hz, until each client has received as many messages as in an hour at 10 Hz; measures the memory of the server, the
clients and the pages over the run (the pages' after a forced garbage collection), and says of each if it is flat. With
--pages 10, eight more pages have the 50 topics open.

CPU use is that of a process, in percent of one core.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

import psutil
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.conftest import free_port

if TYPE_CHECKING:
    from tests.interop.browser import Page

BIN = Path(sys.executable).parent

SENSORS = """
import rospy
from sensor_msgs.msg import Image, LaserScan
rospy.init_node("sensors")
scan = rospy.Publisher("/scan", LaserScan, queue_size=5)
image = rospy.Publisher("/camera/image_raw", Image, queue_size=2)
ranges = [1.0 + index / 1651 for index in range(1651)]
frames = [Image(height=480, width=640, encoding="rgb8", step=1920, data=bytes((index * 16 + x) % 256 for x in range(921600)))
          for index in range(4)]
rospy.Timer(rospy.Duration(1 / 30), lambda event: image.publish(frames[int(event.current_real.to_sec() * 30) % 4]))
rate, count = rospy.Rate(33), 0
while not rospy.is_shutdown():
    count += 1
    ranges[0:20] = [(count + index) % 100 / 50 for index in range(20)]
    scan.publish(LaserScan(ranges=ranges, range_max=5.0))
    rate.sleep()
"""

MANY = """
import sys
import rospy
from std_msgs.msg import Float64MultiArray
rospy.init_node("many")
publishers = [rospy.Publisher(f"/many/t{index}", Float64MultiArray, queue_size=10) for index in range(50)]
message = Float64MultiArray(data=[float(index) for index in range(50)])
rate = rospy.Rate(float(sys.argv[1]))
while not rospy.is_shutdown():
    for each in publishers:
        each.publish(message)
    rate.sleep()
"""

MOVING = """
import math, sys
import rospy
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import Image, LaserScan
from tf2_msgs.msg import TFMessage
rospy.init_node("moving")
images = rospy.Publisher("/camera/image_raw", Image, queue_size=2)
pixels = [bytes((number * 16 + x) % 256 for x in range(320 * 240 * 3)) for number in range(4)]
scans = rospy.Publisher("/scan", LaserScan, queue_size=10)
frames = rospy.Publisher("/tf", TFMessage, queue_size=10)
rate = rospy.Rate(float(sys.argv[1]))
count = 0
while not rospy.is_shutdown():
    count += 1
    moved = TransformStamped(child_frame_id="laser")
    moved.header.frame_id = "map"
    moved.header.stamp = rospy.Time.now()
    moved.transform.translation.x = math.sin(count / 100)
    moved.transform.rotation.w = 1
    frames.publish(TFMessage([moved]))
    scan = LaserScan(angle_increment=0.01, range_max=9, ranges=[3 + math.sin(count / 50 + beam / 30) for beam in range(628)])
    scan.header = moved.header
    scan.header.frame_id = "laser"
    scans.publish(scan)
    images.publish(Image(height=240, width=320, encoding="rgb8", step=960, data=pixels[count % 4]))
    if count % 10 == 0:
        rospy.loginfo("step %d", count)
    rate.sleep()
"""

ARM = """
import math
from pathlib import Path
import rospy, xacro
from geometry_msgs.msg import Quaternion, TransformStamped
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage
import minirospy.ros
from minirospy.core.urdf.poses import quaternion_from_rpy
from minirospy.core.urdf.read import parse_robot
rospy.init_node("arm")
text = xacro.process_file(str(Path(minirospy.ros.__file__).parent / "six_joint_arm/urdf/arm.xacro")).toxml()
rospy.set_param("/robot_description", text)
robot = parse_robot(text, "arm")
frames = rospy.Publisher("/tf", TFMessage, queue_size=10)
scans = rospy.Publisher("/scan", LaserScan, queue_size=10)
rate, count = rospy.Rate(50), 0
while not rospy.is_shutdown():
    count += 1
    found = []
    for joint in robot.joints.values():
        moved = TransformStamped(child_frame_id=joint.child)
        moved.header.frame_id, moved.header.stamp = joint.parent, rospy.Time.now()
        place = moved.transform.translation
        place.x, place.y, place.z = joint.origin.xyz
        roll, pitch, yaw = joint.origin.rpy
        turn = 0.3 * math.sin(count / 50) if joint.type != "fixed" else 0.0
        moved.transform.rotation = Quaternion(*quaternion_from_rpy(roll, pitch, yaw + turn))
        found.append(moved)
    frames.publish(TFMessage(found))
    if count % 5 == 0:
        scan = LaserScan(angle_increment=math.pi / 360, range_max=9)
        scan.ranges = [3 + math.sin(count / 50 + beam / 30) for beam in range(720)]
        scan.header.frame_id, scan.header.stamp = robot.root, rospy.Time.now()
        scans.publish(scan)
    rate.sleep()
"""

# Count what is uploaded while a picture is drawn, and turn the camera in each animation frame.
COUNTED = """
import("./js/scene/stage.js").then(({ Stage }) => {
  window.pictures = [];
  let bytes = 0, programs = 0;
  const size = (...parts) => {
    const data = parts.find(part => part?.byteLength || part?.width);
    return data?.byteLength ?? (data ? data.width * data.height * 4 : 0);
  };
  for (const name of ["bufferData", "bufferSubData", "texImage2D", "texSubImage2D"]) {
    const call = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...parts) { bytes += size(...parts); return call.apply(this, parts); };
  }
  const { linkProgram } = WebGL2RenderingContext.prototype;
  WebGL2RenderingContext.prototype.linkProgram = function (program) { programs += 1; return linkProgram.call(this, program); };
  const { tick } = Stage.prototype;
  Stage.prototype.tick = function (now) {
    window.stage = this;
    const { drawn } = this;
    bytes = programs = 0;
    const started = performance.now();
    if (window.areTurned) this.rotate(1, 0);
    tick.call(this, now);
    if (this.drawn === drawn) return;
    const { calls, triangles } = this.renderer.info.render;
    pictures.push({ ms: performance.now() - started, at: started, calls, triangles, bytes, programs });
  };
})
"""

MAX_GROWTH = 0.05  # of the size between two thirds of a soak: more is no noise of the garbage collector
MIN_GROWTH_MB = 2.0  # a smaller growth is flat, whatever the size
GC_FLAGS = ("--js-flags=--expose-gc", "--enable-precise-memory-info")
HEAP = "(() => { gc(); return performance.memory.usedJSHeapSize })()"

FRAMES = """
new Promise(resolve => {
  const times = [];
  const step = now => {
    times.push(now);
    if (now - times[0] < %d) return requestAnimationFrame(step);
    const gaps = times.slice(1).map((each, index) => each - times[index]).sort((a, b) => a - b);
    resolve({ fps: gaps.length / (now - times[0]) * 1000, p99: gaps[Math.floor(gaps.length * 0.99)], longest: gaps.at(-1),
              heap: performance.memory.usedJSHeapSize });
  };
  requestAnimationFrame(step);
})
"""


@contextlib.contextmanager
def graph() -> Iterator[tuple[psutil.Process, int]]:
    """Run a master and a dashboard; yield the dashboard's process and port."""
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{free_port()}"
    os.environ["ROS_HOSTNAME"] = "localhost"
    with tempfile.TemporaryDirectory() as home, contextlib.ExitStack() as stack:
        os.environ["ROS_HOME"] = home
        start(stack, str(BIN / "roscore"), "-p", os.environ["ROS_MASTER_URI"].rpartition(":")[2])
        wait_for_master()
        dashboard = start(stack, str(BIN / "minirospy"), "dashboard", "--no-browser", "--port", "0")
        assert dashboard.stdout
        found = re.search(rb":(\d+)/", dashboard.stdout.readline())
        assert found, "the dashboard prints no link"
        yield psutil.Process(dashboard.pid), int(found[1])


def start(stack: contextlib.ExitStack, *words: str) -> subprocess.Popen[bytes]:
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def end() -> None:
        process.terminate()
        process.communicate(timeout=30)

    stack.callback(end)
    return process


def wait_for_master() -> None:
    from xmlrpc.client import ServerProxy

    end = time.monotonic() + 60
    while time.monotonic() < end:
        with contextlib.suppress(OSError), ServerProxy(os.environ["ROS_MASTER_URI"]) as master:
            master.getPid("/benchmark")
            return
        time.sleep(0.1)
    raise SystemExit("the master does not start")


def cpu(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


def measure_page(seconds: float) -> None:
    """Print the frames per second of a page with a scan, an image and ten plots."""
    from tests.interop.browser import Page

    plots = ",".join(f"plot?path=%252Fscan%252Franges[{index}:{index + 2}]" for index in range(0, 20, 2))
    tree = f"row(column(image?topic=%252Fcamera%252Fimage_raw,topics?open=%252Fscan),{columns(plots)})"
    with graph() as (server, port), contextlib.ExitStack() as stack:
        start(stack, sys.executable, "-c", SENSORS)
        page = Page(f"http://localhost:{port}/#/layout?tree={tree}", width=1600, height=900)
        try:
            page.wait_text(".status", "30")
            page.wait(
                "return [...document.querySelectorAll('.series .num')].filter(e => /[0-9]/.test(e.textContent)).length === 20"
            )
            before, spent = time.monotonic(), cpu(server)
            found = page.evaluate(FRAMES % (seconds * 1000))
            share = (cpu(server) - spent) / (time.monotonic() - before) * 100
            drawn = page.evaluate("document.querySelector('.status').textContent")
        finally:
            page.close()
    print(
        f"page: {found['fps']:.1f} frames a second, 99 % within {found['p99']:.0f} ms, longest {found['longest']:.0f} ms; "
        f"heap {found['heap'] / 1e6:.0f} MB; server {share:.0f} % CPU; image {drawn}"
    )


def metrics(page: Page) -> dict[str, float]:
    """Return chromium's counters of the page's main thread: seconds of CPU time of scripts and of all tasks."""
    found = page.call("Performance.getMetrics")["metrics"]
    return {each["name"]: each["value"] for each in found}


def measure_scene(pictures: int, *, has_gpu: bool) -> None:
    """Print what a picture of the 3D view with an arm and a scan costs."""
    from tests.interop.browser import Page

    flags = (
        *GC_FLAGS,
        *(("--enable-gpu", "--ignore-gpu-blocklist", "--use-angle=gl-egl") if has_gpu else ()),
    )
    with graph() as (_, port), contextlib.ExitStack() as stack:
        start(stack, sys.executable, "-c", ARM)
        page = Page(f"http://localhost:{port}/#/topics", width=1280, height=800, flags=flags)
        stack.callback(page.close)
        page.evaluate(COUNTED)
        page.evaluate("location.hash = '#/3d'")
        page.wait(
            "return document.querySelectorAll('.display[data-level=ok]').length >= 4 && pictures.length > 20"
        )
        if has_gpu and page.evaluate("stage.isSoftware"):
            raise SystemExit(
                f"scene: --gpu: chromium draws in software: {page.evaluate('stage.rendererName')}"
            )
        page.call("Performance.setTimeDomain", timeDomain="threadTicks")
        page.call("Performance.enable")
        page.evaluate("window.areTurned = true; pictures.length = 0")
        page.wait("return pictures.length > 20")
        heap, memory = page.evaluate(HEAP), page.evaluate("({ ...stage.renderer.info.memory })")
        before = metrics(page)
        page.evaluate("pictures.length = 0")
        page.wait(f"return pictures.length >= {pictures}")
        found, after = page.evaluate("pictures"), metrics(page)
        grown = (page.evaluate(HEAP) - heap) / 1e6
        renderer = page.evaluate("stage.rendererName")
        held = page.evaluate("({ ...stage.renderer.info.memory })")
    times = sorted(each["ms"] for each in found)
    seconds = (found[-1]["at"] - found[0]["at"]) / 1000
    scripts, tasks = (
        (after[name] - before[name]) / len(found) * 1000 for name in ("ScriptDuration", "TaskDuration")
    )
    uploads = sorted(each["bytes"] for each in found)
    print(f"scene: {renderer}: {(len(found) - 1) / seconds:.1f} pictures a second, {len(found)} pictures")
    print(
        f"scene: JavaScript of a picture: median {times[len(times) // 2]:.1f} ms, "
        f"95 % within {times[int(len(times) * 0.95)]:.1f} ms; CPU time of all scripts: {scripts:.1f} ms a picture, "
        f"of all tasks of the main thread: {tasks:.1f} ms"
    )
    print(
        f"scene: {found[-1]['calls']} draw calls, {found[-1]['triangles']} triangles; uploaded for a picture: "
        f"median {uploads[len(uploads) // 2]} bytes, 95 % within {uploads[int(len(uploads) * 0.95)]} bytes"
    )
    programs = sum(each["programs"] for each in found)
    print(f"scene: {programs} shader programs compiled during {len(found)} pictures")
    print(f"scene: heap {grown:+.2f} MB over the run; geometries and textures: {memory} -> {held}")


def columns(plots: str) -> str:
    all_plots = plots.split(",")
    return f"column({','.join(all_plots[:5])}),column({','.join(all_plots[5:])})"


class Client(threading.Thread):
    """Subscribes to all topics with a prefix, as the page does, and counts messages."""

    def __init__(self, port: int) -> None:
        super().__init__(daemon=True)
        self.messages = self.bytes = self.topics = 0
        self._socket = connect(
            f"ws://localhost:{port}/",
            subprotocols=[Subprotocol("foxglove.sdk.v1")],
            compression=None,
            max_size=None,
            ping_interval=None,
        )

    def run(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            for data in self._socket:
                if isinstance(data, bytes):
                    self.messages += 1
                    self.bytes += len(data)
                    continue
                fields = json.loads(data)
                if fields["op"] == "advertise":
                    new = [each["id"] for each in fields["channels"] if each["topic"].startswith("/many/")]
                    self.topics += len(new)
                    wanted = [{"id": each, "channelId": each} for each in new]
                    self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    def close(self) -> None:
        self._socket.close()


def measure_clients(seconds: float, rate: float) -> None:
    """Print memory and CPU with ten clients on 50 topics."""
    with graph() as (server, port), contextlib.ExitStack() as stack:
        start(stack, sys.executable, "-c", MANY, str(rate))
        clients = [Client(port) for _ in range(10)]
        for each in clients:
            stack.callback(each.close)
            each.start()
        limit = time.monotonic() + 60
        while not all(each.topics == 50 and each.messages for each in clients):
            assert time.monotonic() < limit, [each.topics for each in clients]
            time.sleep(0.1)
        time.sleep(3)

        own = psutil.Process()
        memory = [(server.memory_info().rss, own.memory_info().rss)]
        before, spent = time.monotonic(), cpu(server)
        counts = [(each.messages, each.bytes) for each in clients]
        for _ in range(10):
            time.sleep(seconds / 10)
            memory.append((server.memory_info().rss, own.memory_info().rss))
        used, elapsed = cpu(server) - spent, time.monotonic() - before
        messages = sum(each.messages - count for each, (count, _) in zip(clients, counts, strict=True))
        megabytes = sum(each.bytes - size for each, (_, size) in zip(clients, counts, strict=True)) / 1e6
    hours = messages / (10 * 50 * 10 * 3600)
    sizes = ", ".join(f"{server_size / 1e6:.1f}" for server_size, _ in memory)
    print(
        f"clients: {messages} messages, {megabytes:.0f} MB in {elapsed:.0f} s ({hours:.2f} hours of 50 topics at 10 Hz); "
        f"server {used / elapsed * 100:.0f} % CPU, {used / megabytes * 1000:.1f} ms a MB"
    )
    print(
        f"clients: server's memory in MB: {sizes}; all clients: {memory[0][1] / 1e6:.1f} -> {memory[-1][1] / 1e6:.1f}"
    )


def measure_soak(hours: float, rate: float, count_of_clients: int, count_of_pages: int) -> None:
    """Print the memory over a long run with clients and pages. The run is as long as ``hours`` of 50 topics at 10 Hz."""
    from tests.interop.browser import Page

    opened = "&".join(f"open=%2Fmany%2Ft{index}" for index in range(50))
    plots = "&".join(f"path=%2Fmany%2Ft{index}%2Fdata[0]" for index in range(4))
    topics = f"topics?{opened}"
    image = "image?topic=%2Fcamera%2Fimage_raw"
    trees = [f"row({topics},console)", f"row(3d,column(plot?{plots},graph,{image}))", *[topics] * 8]
    with graph() as (server, port), contextlib.ExitStack() as stack:
        pages = []
        for tree in trees[:count_of_pages]:
            pages.append(Page(f"http://localhost:{port}/#/layout?tree={quote(tree)}", flags=GC_FLAGS))
            stack.callback(pages[-1].close)
        start(stack, sys.executable, "-c", MANY, str(rate))
        start(stack, sys.executable, "-c", MOVING, str(rate))
        clients = [Client(port) for _ in range(count_of_clients)]
        for each in clients:
            stack.callback(each.close)
            each.start()
        for page in (pages[0], *pages[2:]):
            page.wait("return document.querySelectorAll('.topics [aria-expanded=true]').length >= 50")
        pages[1].wait("return Number(document.querySelector('canvas.stage')?.dataset.drawn) > 10")
        time.sleep(20)

        spent, started = cpu(server), time.monotonic()
        counts = [(each.messages, each.bytes) for each in clients]
        wanted = hours * 50 * 10 * 3600
        rows = []
        print("soak: seconds  server  clients  of each page: heap, processes  (MB)")
        for step in range(13):
            while (
                min(each.messages - count for each, (count, _) in zip(clients, counts, strict=True))
                < wanted * step / 12
            ):
                time.sleep(0.2)
            row = [memory_of(server), memory_of(psutil.Process())]
            for page in pages:
                row += [page.evaluate(HEAP) / 1e6, sum(memory_of(each) for each in page.processes())]
            rows.append(row)
            print(
                f"soak: {time.monotonic() - started:7.0f}  " + "  ".join(f"{each:7.1f}" for each in row),
                flush=True,
            )
        used, elapsed = cpu(server) - spent, time.monotonic() - started
        messages = [each.messages - count for each, (count, _) in zip(clients, counts, strict=True)]
        drawn = pages[1].evaluate("document.querySelector('canvas.stage').dataset.drawn")
    print(
        f"soak: {elapsed:.0f} s; each client had {min(messages)} to {max(messages)} messages of 50 topics, "
        f"as in {min(messages) / (50 * 10 * 3600):.2f} hours at 10 Hz; server {used / elapsed * 100:.0f} % CPU; "
        f"{drawn} pictures of the 3D view; errors of the pages: {[page.errors for page in pages]}"
    )
    names = ["server", "clients"]
    for number in range(1, count_of_pages + 1):
        names += [f"heap of page {number}", f"processes of page {number}"]
    for name, *sizes in zip(names, *rows, strict=True):
        print(f"soak: {name}: {verdict_of(sizes)}")


def verdict_of(sizes: list[float]) -> str:
    """Return whether memory sizes in MB, taken at equal intervals, are flat.

    The first third is the start, in which caches fill. Compares the smallest sizes of the two other thirds: messages under way
    come and go, and what is never released is in the smallest size, too.
    """
    third = len(sizes) // 3
    middle, last = (min(part) for part in (sizes[third:-third], sizes[-third:]))
    growth = last - middle
    is_flat = growth <= max(MAX_GROWTH * middle, MIN_GROWTH_MB)
    return (
        f"{'flat' if is_flat else 'GROWS'}: {middle:.1f} MB in the middle third, {growth:+.1f} MB in the last"
    )


def memory_of(process: psutil.Process) -> float:
    """Return a process's private memory in MB, or 0 if it has exited."""
    with contextlib.suppress(psutil.NoSuchProcess):
        full = process.memory_full_info()
        return float(getattr(full, "uss", full.rss)) / 1e6
    return 0.0


def main() -> None:
    """Run the measurements that the arguments select, by default page and clients."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "what", nargs="*", default=["page", "clients"], choices=["page", "scene", "clients", "soak"]
    )
    parser.add_argument("--seconds", type=float, default=10.0, help="of the measurement")
    parser.add_argument("--pictures", type=int, default=300, metavar="N", help="of the scene")
    parser.add_argument("--gpu", action="store_true", help="draw the scene on the graphics card")
    parser.add_argument("--hours", type=float, default=1.0, help="of the soak, in slow motion")
    parser.add_argument("--clients", type=int, default=10, metavar="N", help="of the soak, at least one")
    parser.add_argument(
        "--pages", type=int, default=2, choices=range(2, 11), metavar="N", help="of the soak: 2 to 10"
    )
    parser.add_argument("--rate", type=float, default=100.0, help="of each of the 50 topics, in Hz")
    words = parser.parse_args()
    if "page" in words.what:
        measure_page(words.seconds)
    if "scene" in words.what:
        measure_scene(words.pictures, has_gpu=words.gpu)
    if "clients" in words.what:
        measure_clients(words.seconds, words.rate)
    if "soak" in words.what:
        measure_soak(words.hours, words.rate, words.clients, words.pages)


if __name__ == "__main__":
    main()
