"""Make the pictures of docs/dashboard: `python tools/dashboard_pictures.py [NAME ...]`.

Shows each view with the same robot in a room as the tests, in Debian's chromium. If `pngquant` is installed, pictures
have at most 128 colors, which keeps them small. Look at each picture before you commit it.
"""

from __future__ import annotations

import argparse
import math
import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rosgraph_msgs.msg import Log  # noqa: E402 - the folder above comes first
from sensor_msgs.msg import Image, LaserScan  # noqa: E402
from std_msgs.msg import Bool, String  # noqa: E402
from turtlesim.msg import Pose  # noqa: E402

from minirospy.board.board import Board  # noqa: E402
from minirospy.runtime.master.master import Master  # noqa: E402
from minirospy.runtime.transport.loop import LoopThread  # noqa: E402
from minirospy.web.access import Access  # noqa: E402
from minirospy.web.bridge import BridgeOptions  # noqa: E402
from tests.interop.browser import Page  # noqa: E402
from tests.interop.test_interop_dashboard import address, publisher  # noqa: E402
from tests.interop.test_interop_walk import furnish, use  # noqa: E402
from tests.web.dashboard.bags import make_bag  # noqa: E402
from tests.web.dashboard.conftest import TOKEN, Served  # noqa: E402

FOLDER = ROOT / "docs" / "dashboard"
COLORS = "128"
LINES = (
    (2, "/talker_scan", "the scanner is ready"),
    (4, "/led", "the battery is low"),
    (8, "/arm", "no motor answers at /dev/ttyUSB0"),
    (2, "/talker_camera", "30 images per second"),
)


class Picture(NamedTuple):
    """A view to show: its link, a text to wait for in a selected element, and the window's size in pixels."""

    link: str
    wait: tuple[str, str] | None = None
    size: tuple[int, int] = (1200, 760)


PICTURES = {
    "overview": Picture("overview", (".findings", "/scan_front is silent")),
    "topics": Picture("topics?open=/turtle1/pose", (".fields", "theta"), (960, 560)),
    "console": Picture("console", (".line .text", "no motor answers"), (960, 520)),
    "plot": Picture("plot?path=/turtle1/pose/x&path=/turtle1/pose/y&window=10", (".series .num", "."), (960, 620)),
    "plot_xy": Picture("plot?path=/turtle1/pose/x&path=/turtle1/pose/y&x=/turtle1/pose/x", (".series .num", ".")),
    "graph": Picture("graph?filter=navigation", (".traffic", "Hz")),
    "image": Picture("image?topic=/camera/image_raw", (".status", "320"), (1000, 600)),
    "board": Picture("board", ("svg.board text", "GPIO 11"), (960, 500)),
    "publish": Picture("publish", None, (960, 560)),
    "nodes": Picture("nodes?node=/talker_scan", (".side h2", "/talker_scan")),
    "tf": Picture("tf", (".tf .frame-box", "left_wheel")),
    "smach": Picture("smach", (".smach-state", "DOCK")),
    "diagnostics": Picture("diagnostics", (".report", "Battery"), (1200, 560)),
    "bags": Picture("bag?file=walk.bag", (".bag-label", "/chatter")),
    "workshop": Picture("layout?preset=workshop", (".pane .line .text", "no motor answers"), (1400, 860)),
}  # fmt: skip


@contextmanager
def scene(folder: Path) -> Iterator[Served]:
    """Run a master, a robot that moves, a board, and a dashboard; yield the dashboard."""
    loop = LoopThread("pictures-master")

    async def start() -> Master:
        master = Master()
        await master.start()
        return master

    master = loop.run(start())
    os.environ.update(ROS_MASTER_URI=f"http://localhost:{master.port}", ROS_HOSTNAME="localhost")
    os.environ["MINIROSPY_RUNTIME_DIR"] = str(folder / "boards")
    served = Served(BridgeOptions(foxglove_port=0, diagnostics=False, access=Access(write_token=TOKEN)))
    stopped = threading.Event()
    moving: threading.Thread | None = None
    try:
        served.start()
        furnish(served)
        moving = threading.Thread(target=move, args=(served, stopped))
        moving.start()
        with Board():
            yield served
    finally:
        stopped.set()
        if moving:
            moving.join()
        served.close()
        loop.run(master.close(), 30.0)
        loop.close()


def move(served: Served, stopped: threading.Event) -> None:
    """Publish a turtle on a circle, a button, images and log lines until ``stopped`` is set."""
    turtle = publisher(served, "/turtle1/pose", Pose)
    button = publisher(served, "/button", Bool)
    camera = publisher(served, "/camera/image_raw", Image)
    log = publisher(served, "/rosout_agg", Log)
    publisher(served, "/scan_front", LaserScan)
    listening = served.node("navigation")

    async def listen() -> list[object]:
        topics = (
            ("/scan_front", LaserScan),
            ("/turtle1/pose", Pose),
            ("/button", Bool),
            ("/goal_text", String),
        )
        return [await listening.subscribe(topic, cls) for topic, cls in topics]

    kept = served.run(listen())
    count = 0
    while not stopped.wait(0.05):
        count += 1
        angle = count / 30
        pose = Pose(
            x=5.5 + 3 * math.cos(angle),
            y=5.5 + 3 * math.sin(angle),
            theta=angle % math.pi,
            linear_velocity=1.0,
        )
        served.run(turtle.publish(pose))
        served.run(button.publish(count % 40 < 20))
        if count % 4 == 0:
            served.run(camera.publish(picture(count)))
        if count % 20 == 0:
            level, name, text = LINES[count // 20 % len(LINES)]
            line = Log(level=level, name=name, msg=text, file="robot.py", line=12, function="step")
            line.header.stamp = served.node_of_dashboard.now()
            served.run(log.publish(line))
    del kept


def picture(count: int) -> Image:
    """Return a color gradient with a square that moves."""
    width, height = 320, 240
    rows = []
    left = count * 3 % (width - 40)
    for y in range(height):
        row = bytearray()
        for x in range(0, width, 4):
            inside = left <= x < left + 40 and 100 <= y < 140
            row += (bytes((240, 60, 40)) if inside else bytes((x * 255 // width, y, 160))) * 4
        rows.append(bytes(row))
    return Image(width=width, height=height, encoding="rgb8", step=3 * width, data=b"".join(rows))


def take(served: Served, name: str, output: Path, settle: Callable[[Page], None]) -> None:
    """Save the picture of a view."""
    chosen = PICTURES[name]
    page = Page(address(served, chosen.link), width=chosen.size[0], height=chosen.size[1])
    try:
        if chosen.wait:
            page.wait_text(*chosen.wait)
        if name == "publish":
            use(page, "publish")
        settle(page)
        page.screenshot(output)
    finally:
        page.close()


def main() -> None:
    """Make the pictures that the arguments name, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*PICTURES, []], default=[])
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where the pictures are written")
    options = parser.parse_args()
    folder = options.folder.absolute()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home, ExitStack() as stack:
        stack.callback(os.chdir, Path.cwd())
        os.chdir(home)
        make_bag(Path(home, "walk.bag"), 10)
        served = stack.enter_context(scene(Path(home)))
        for name in options.names or PICTURES:
            output = folder / f"{name}.png"
            seconds = 8 if name.startswith("plot") or name == "workshop" else 2
            take(
                served, name, output,
                lambda page, seconds=seconds: page.evaluate(  # type: ignore[misc]
                    f"new Promise(resolve => setTimeout(resolve, {seconds * 1000}))"
                ),
            )  # fmt: skip
            if pngquant := shutil.which("pngquant"):
                subprocess.run([pngquant, "--force", "--ext", ".png", COLORS, str(output)], check=True)
            print(output, output.stat().st_size)


if __name__ == "__main__":
    main()
