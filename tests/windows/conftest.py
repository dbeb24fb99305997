"""The environment for tests with Windows' CPython under Wine.

`make windows` sets up Wine; without it, these tests are skipped.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import free_port
from tests.windows.programs import WINDOWS, Run, Start, no_process_left

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if HERE in item.path.parents:
            if not WINDOWS.is_ready:
                item.add_marker(pytest.mark.skip(reason="`make windows` sets it up"))
            item.add_marker(pytest.mark.timeout(900))


@pytest.fixture(autouse=True, scope="session")
def _wine_server() -> Iterator[None]:
    if not WINDOWS.is_ready:
        yield
        return
    WINDOWS.start_server()
    yield
    WINDOWS.stop_server()


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """Return a folder whose name contains a space and an umlaut."""
    folder = tmp_path / "Übung eins"
    folder.mkdir()
    return folder


@pytest.fixture
def environ(place: Path) -> dict[str, str]:
    return {
        "ROS_MASTER_URI": f"http://localhost:{free_port()}",
        "ROS_HOME": WINDOWS.path(place / "home"),
        "ROS_PACKAGE_PATH": WINDOWS.path(place),
        "MINIROSPY_BOARD": place.parent.name,
        "MINIROSPY_LOCAL": "1",
        "PYTHONUNBUFFERED": "1",
    }


@pytest.fixture
def start(place: Path, environ: dict[str, str]) -> Iterator[Start]:
    """Return a function that starts a Windows command; kill all Windows processes after the test."""
    runs: list[Run] = []

    def start(*words: str, **more: str) -> Run:
        runs.append(Run(WINDOWS.popen(*words, folder=place, environ={**environ, **more})))
        return runs[-1]

    yield start
    for run in runs:
        run.process.kill()
    # Wine may keep a killed client's connection open, and its virtual board would wait for it.
    WINDOWS.stop_server()
    for run in runs:
        run.close()
    no_process_left()
    WINDOWS.start_server()
