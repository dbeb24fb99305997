"""Plot in Debian's chromium: whole bags without playing them, several, differences, and finer points after a zoom."""

from __future__ import annotations

import math
from collections.abc import Callable
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from minirospy.core.bag.writer import BagWriter
from tests.interop.browser import Page
from tests.interop.test_interop_dashboard import address, browse, needs_chromium, publisher, serve
from tests.web.dashboard.conftest import TOKEN, Served

__all__ = ["browse", "serve"]

SECOND = 10**9
SPIKE = 1000.0


def write_bag(path: Path, start: float, rows: dict[str, list[tuple[float, Any]]]) -> None:
    """Write messages by topic, each with its seconds since ``start``."""
    with path.open("wb") as stream:
        writer = BagWriter(stream)
        ordered = []
        for topic, messages in rows.items():
            kind = type(messages[0][1])
            number = writer.add_connection(
                topic, {"type": kind._type, "md5sum": kind._md5sum, "message_definition": kind._full_text}
            )
            ordered += [(time, number, message) for time, message in messages]
        for time, number, message in sorted(ordered, key=lambda row: row[0]):
            buffer = BytesIO()
            message.serialize(buffer)
            writer.write(number, round((start + time) * SECOND), buffer.getvalue())
        writer.close()


@pytest.fixture
def bags(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with long.bag, which has a spike between 50,000 points, and short.bag."""
    monkeypatch.chdir(tmp_path)
    count = 50_000
    wave = [(at / 500, Float64(SPIKE if at == 30_000 else math.sin(at / 500))) for at in range(count)]
    joints = [
        (
            float(at),
            JointState(name=["wrist", "elbow"] if at % 2 else ["elbow", "wrist"], position=[1.0, 2.0]),
        )
        for at in range(100)
    ]
    write_bag(tmp_path / "long.bag", 1000, {"/wave": wave, "/joint_states": joints})
    line = [(at + 0.5, Float64(float(at))) for at in range(10)]
    twice = [(float(at), Float64(2.0 * at)) for at in range(10)]
    write_bag(tmp_path / "short.bag", 99_000, {"/twice": twice, "/line": line})
    return tmp_path


def hash_of(*paths: str) -> str:
    from urllib.parse import quote

    return "plot?" + "&".join(f"path={quote(path)}" for path in paths) + f"&token={TOKEN}"


@needs_chromium
def test_whole_bag_is_plotted_without_playing_it_and_zoom_shows_finer_points(
    bags: Path, serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), hash_of("long.bag:/wave/data")))
    page.wait_text(".series .count", "50000 points")
    page.wait_text(".series .label", "long.bag:/wave/data")
    # A single spike in 50,000 points is seen.
    assert page.evaluate("location.hash").startswith("#/plot?path=long.bag")
    saved = """new Promise(resolve => { URL.createObjectURL = blob => { blob.text().then(resolve); return ''; };
        [...document.querySelectorAll('button')].find(e => e.textContent === 'CSV').click(); })"""
    coarse = page.evaluate(saved).splitlines()[1:]
    assert len(coarse) < 20_000
    assert max(float(line.split(",")[1]) for line in coarse) == SPIKE

    page.evaluate(
        "for (let n = 0; n < 4; n++) document.querySelector('.chart').dispatchEvent("
        "new KeyboardEvent('keydown', {key: '+', bubbles: true, cancelable: true}))"
    )
    # The last 6 s are shown. Their points come, and those before and after them.
    wait_for_more = f"text => {{ window.isFiner = text.split('\\n').length > {len(coarse)} + 900; }}"
    page.wait(f"{saved}.then({wait_for_more}); return window.isFiner")
    fine = [tuple(map(float, line.split(","))) for line in page.evaluate(saved).splitlines()[1:]]
    shown = [time for time, _ in fine if time > 95]
    assert max(b - a for a, b in pairwise(shown)) == pytest.approx(0.002)


@needs_chromium
def test_two_bags_a_joint_and_a_difference_share_a_plot(
    bags: Path, serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    difference = "short.bag:/line/data - short.bag:/twice/data"
    page = browse(
        address(
            serve(), hash_of("long.bag:/joint_states/position[elbow]", "short.bag:/twice/data", difference)
        )
    )
    # The values are shown in the picture after that in which the series come.
    rows = page.wait(
        "const rows = [...document.querySelectorAll('.series')].map(e =>"
        " [e.querySelector('.label').textContent, e.querySelector('.num').textContent]);"
        "return rows.length === 3 && rows.every(([, value]) => value) && rows"
    )
    assert dict(rows) == {
        "long.bag:/joint_states/position[elbow]": "2",
        "short.bag:/twice/data": "18",
        difference: str(8 - 17),
    }


@needs_chromium
def test_bag_is_chosen_and_errors_have_one_line(
    bags: Path, serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    (bags / "broken.bag").write_bytes(b"no bag")
    served = serve()
    publisher(served, "/live", PointStamped)
    page = browse(address(served, f"plot?token={TOKEN}"))
    page.click("form button", "Bags")
    page.wait("return [...document.querySelectorAll('option')].some(e => e.value === 'short.bag')")
    page.choose("select[aria-label='Plot paths of this bag']", "short.bag")
    page.wait(
        "return [...document.querySelectorAll('datalist option')].some(e => e.value === 'short.bag:/line/data')"
    )
    for path, why in {
        "/line/data": "",
        "broken.bag:/x": "broken.bag: ",
        "missing.bag:/x": "'missing.bag' cannot be opened",
        "../x.bag:/x": "is not the name of a bag",
        "/other/x": "/line",
        "/line/rubbish": "no number at /line",
        "long.bag:/live/point/x": "/joint_states",
    }.items():
        page.type("form input", path)
        page.click("form button", "Plot")
        if why:
            page.wait_text(".series-missing .error", why)
        else:
            page.wait_text(".series .label", "short.bag:/line/data")
    page.click("form button", "Bags")
    page.type("form input", "/live/point/x")
    page.click("form button", "Plot")
    page.wait_text(".series-missing .error", "live topics and bags are in separate plots")
    page.click("button", "Remove all")
    page.type("form input", "/live/point/x")
    page.click("form button", "Plot")
    page.wait_text(".series-missing .muted", "waiting for /live/point/x")


@needs_chromium
def test_field_of_an_open_bag_links_to_its_plot(
    bags: Path, serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), f"bag?file=short.bag&token={TOKEN}"))
    page.click("a.plot[title='Plot short.bag:/twice/data']", "plot")
    page.wait_text(".series .count", "10 points")


@needs_chromium
def test_shown_topics_of_a_bag_are_exported(
    bags: Path, serve: Callable[..., Served], browse: Callable[..., Page]
) -> None:
    page = browse(address(serve(), f"bag?file=short.bag&token={TOKEN}"))
    page.wait_text(".bag-label .name", "/line")
    page.choose("select[aria-label='Export the shown topics']", "csv")
    page.wait_text("p[role=status]", "short_line.csv: 10 rows, 2 columns")
    assert (bags / "short_line.csv").read_text(encoding="utf-8").splitlines()[1] == "99000.500000000,0.0"
    # The second one would replace a file.
    page.choose("select[aria-label='Export the shown topics']", "csv")
    page.wait_text("p.error", "exists already")
