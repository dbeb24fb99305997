"""Show a dashboard view in a notebook cell.

The dashboard is a child process of the kernel that listens only on loopback. It exits when its standard input is closed, and
therefore also if the kernel is killed. A notebook page may embed it (``minirospy dashboard --embed``).
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterable
from html import escape
from typing import Any
from urllib.parse import parse_qs, urlsplit

from minirospy.base.errors import MinirospyError
from minirospy.base.suggestions import did_you_mean
from minirospy.web.dashboard.views import VIEWS, link

__all__ = ["Frame", "view"]

_HEIGHT = 420  # pixels


class Frame:
    """A dashboard view, which IPython displays in a cell as an HTML iframe."""

    def __init__(self, url: str, height: int) -> None:
        self.url = url
        self.height = height

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{escape(self.url)}" width="100%" height="{self.height}" style="border:0" '
            'allow="fullscreen; clipboard-write"></iframe>'
        )

    def __repr__(self) -> str:
        return f"Frame({self.url.partition('?')[0]})"


class _Dashboard:
    """A dashboard process, with the host, port and token of its page."""

    def __init__(self, process: subprocess.Popen[str], url: str) -> None:
        self.process = process
        parts = urlsplit(url)
        self.host, self.port = parts.hostname or "", parts.port or 0
        self.token = parse_qs(parts.fragment.partition("?")[2]).get("token", [""])[0]


class _Dashboards:
    """The dashboard processes of this kernel, keyed by master URI."""

    lock = threading.Lock()
    by_master: dict[str, _Dashboard] = {}


def view(name: str = "topics", *, height: int = _HEIGHT, **fields: str | Iterable[str]) -> Frame:
    """Return a dashboard view to display: as the last expression of a cell, or with ``display``.

    ``name``: plot, 3d, graph, image, console or another view. ``height``: pixels. ``fields``: the view's settings, as in its
    link: for example ``path="/odom/twist/twist/linear/x"`` for a plot, or ``topic="/camera/image_raw"`` for an image. The first
    call starts the dashboard. While there is no master, the view explains how to start one. Raise MinirospyError if the view does
    not exist or the dashboard does not start.
    """
    if name not in VIEWS:
        known = ", ".join(VIEWS)
        raise MinirospyError(f"there is no view '{name}'{did_you_mean(name, VIEWS)}: there are {known}")
    with _Dashboards.lock:
        master = os.environ.get("ROS_MASTER_URI", "")
        dashboard = _Dashboards.by_master.get(master)
        if dashboard is None or dashboard.process.poll() is not None:
            dashboard = _Dashboards.by_master[master] = _start()
    settings = {key: (value,) if isinstance(value, str) else tuple(value) for key, value in fields.items()}
    return Frame(link(dashboard.host, dashboard.port, name, settings, token=dashboard.token), height)


def _start() -> _Dashboard:
    # Use a new process group, because interrupting a cell sends the signal to the kernel's whole group.
    group: dict[str, Any] = {"start_new_session": True}
    if sys.platform == "win32":
        group = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    process = subprocess.Popen(
        [sys.executable, "-m", "minirospy", "dashboard", "--embed", "--no-browser", "--port", "0"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        **group,
    )
    assert process.stdout
    said = []
    for line in process.stdout:
        said.append(line)
        url = next((word for word in line.split() if word.startswith("http") and "token=" in word), "")
        if url:
            # Discard further output, so that the process never blocks on a full pipe.
            threading.Thread(target=deque, args=(process.stdout, 0), daemon=True).start()
            return _Dashboard(process, url)
    said.append(process.communicate()[0])  # also closes the pipes
    raise MinirospyError(f"the dashboard did not start: {''.join(said).strip()}")
