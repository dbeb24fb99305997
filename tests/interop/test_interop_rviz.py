"""Debian's RViz as the reference for the dashboard's 3D view: the same file, topics and camera must give the same colors."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest
from PIL import Image, ImageChops

from tests.interop import rviz_pictures
from tests.interop.browser import PATIENCE, Page
from tests.interop.rviz_pictures import HEIGHT, WIDTH, Rviz
from tests.interop.test_interop_dashboard import address, browse, needs_chromium
from tests.web.dashboard.conftest import Served, serve

__all__ = ["browse", "serve"]

pytestmark = [
    needs_chromium,
    pytest.mark.skipif(
        not rviz_pictures.has_rviz(),
        reason="RViz is not installed: apt-get install rviz xvfb libgl1-mesa-dri",
    ),
]

BACKGROUND = (48, 48, 48)
ALIKE = 16  # maximum difference (of 255) in red, green and blue, because edges are smoothed differently


def bodies(picture: Image.Image) -> list[tuple[int, int]]:
    """Return positions inside drawn bodies, whose surroundings have about one color that is not the background's."""
    found = []
    for y in range(4, HEIGHT - 4, 4):
        for x in range(4, WIDTH - 4, 4):
            around = picture.crop((x - 2, y - 2, x + 3, y + 3)).getextrema()
            far = max(abs(low - own) for (low, _), own in zip(around, BACKGROUND, strict=True))
            if far > 24 and all(high - low < ALIKE for low, high in around):  # type: ignore[operator]
                found.append((x, y))
    return found


def share_of_others(one: Image.Image, other: Image.Image) -> float:
    """Return the share (0 to 1) of drawn positions in one picture that have another color in the other."""
    places = bodies(one)
    if len(places) <= 300:
        return 1.0  # too little is drawn yet, because messages arrive with a delay
    pairs = [(one.getpixel(place), other.getpixel(place)) for place in places]
    return sum(any(abs(a - b) > ALIKE for a, b in zip(*pair, strict=True)) for pair in pairs) / len(pairs)  # type: ignore[arg-type]


@pytest.mark.parametrize("scene", ["markers", "meshes", "robots"])
def test_bodies_have_the_places_sizes_and_colors_of_rviz(
    scene: str,
    serve: Callable[..., Served],
    browse: Callable[..., Page],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    rviz_pictures.prepare(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    monkeypatch.setenv("ROS_HOSTNAME", "localhost")
    served = serve()
    assert served.dashboard
    rviz_pictures.publish(served, rviz_pictures.messages())
    if scene == "robots":
        rviz_pictures.publish_robots(served)
    file = tmp_path / "scene.rviz"
    rviz_pictures.write_file(file, scene)
    rviz = Rviz(file, tmp_path)
    request.addfinalizer(rviz.close)
    served.dashboard.rviz.file = file
    page = browse(address(served, "3d?file=1"), width=1100, height=700)
    rviz_pictures.enlarge(page)

    end = time.monotonic() + 2 * PATIENCE
    while True:
        theirs, ours = rviz.settled(), rviz_pictures.our_picture(page)
        shares = share_of_others(theirs, ours), share_of_others(ours, theirs)
        # Compare the whole picture, including lines, edges and text.
        others = ImageChops.difference(theirs, ours).convert("L").histogram()
        share = sum(others[40:]) / (WIDTH * HEIGHT)
        if max(shares) < 0.03 and share < 0.01:
            break
        assert time.monotonic() < end, (
            f"{shares[0]:.1%} of RViz's, {shares[1]:.1%} of ours, {share:.1%} of all have other colors"
        )
