"""`minirospy dashboard` and rqt's commands: as processes, and their usage."""

from __future__ import annotations

import queue
import re
import signal
import ssl
import stat
import subprocess
import sys
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname, urlopen

import pytest

from minirospy.base.errors import MasterUnreachableError
from minirospy.cli import dashboard as command
from minirospy.web.dashboard import browser
from minirospy.web.dashboard.browser import has_screen, open_link
from minirospy.workspace.packages import Packages
from tests.conftest import free_port
from tests.waiting import wait_until
from tests.web.test_web import make_certificate


@pytest.fixture
def started(master: str) -> Iterator[list[subprocess.Popen[str]]]:
    """Return a list of processes that are stopped after the test."""
    processes: list[subprocess.Popen[str]] = []
    yield processes
    for each in processes:
        if each.poll() is None:
            each.terminate()
        each.communicate(timeout=60)


def link_of(started: list[subprocess.Popen[str]], *words: str) -> str:
    started.append(
        subprocess.Popen(
            [sys.executable, *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
    )
    stdout = started[-1].stdout
    assert stdout
    line = stdout.readline()
    assert line.startswith("Open in a browser: "), line + stdout.read()
    return line.removeprefix("Open in a browser: ").strip()


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another process")
def test_dashboard_prints_its_link_serves_and_ends_with_status_0(
    started: list[subprocess.Popen[str]],
) -> None:
    link = link_of(started, "-m", "minirospy", "dashboard", "topics", "--no-browser", "--port", "0")
    found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/#/topics\?token=[\w-]{22}", link)
    assert found
    connection = HTTPConnection("127.0.0.1", int(found[1]), timeout=60)
    connection.request("GET", "/")
    assert connection.getresponse().status == 200
    connection.close()
    started[0].send_signal(signal.SIGINT)
    assert started[0].wait(60) == 0


def test_page_is_served_before_there_is_a_master(
    started: list[subprocess.Popen[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    port = free_port()
    uri = f"http://localhost:{port}"
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    link = link_of(started, "-m", "minirospy", "dashboard", "--no-browser", "--port", "0")
    token = link.rpartition("token=")[2]
    bearer = {"Authorization": f"Bearer {token}"}

    def status(headers: dict[str, str]) -> tuple[int, str]:
        connection = HTTPConnection("127.0.0.1", urlsplit(link).port or 0, timeout=60)
        try:
            connection.request("GET", "/status", headers=headers)
            answer = connection.getresponse()
            return answer.status, answer.read().decode()
        except (ConnectionError, HTTPException):  # between the two pages the port is free
            return 0, ""
        finally:
            connection.close()

    assert urlopen(link, timeout=60).status == 200
    assert status(bearer) == (503, str(MasterUnreachableError(uri)))
    started.append(
        subprocess.Popen([sys.executable, "-m", "minirospy", "master", "-p", str(port)], text=True)
    )
    wait_until(lambda: status(bearer)[0] == 200, 120, "the dashboard does not start")
    # The link was printed once: the page keeps its port.
    started[0].terminate()
    assert started[0].wait(60) == 0
    assert started[0].stdout
    assert "Open in a browser" not in started[0].stdout.read()


def test_busy_machine_serves_no_page_without_a_master_beside_its_master(
    started: list[subprocess.Popen[str]],
) -> None:
    slow = (
        "import asyncio, sys; from minirospy.cli import dashboard; from minirospy.web.dashboard import waiting_page\n"
        "connect = asyncio.open_connection\n"
        "async def connect_later(*words):\n"
        "    await asyncio.sleep(0.01)\n"
        "    return await connect(*words)\n"
        "asyncio.open_connection, waiting_page.WaitingPage = connect_later, None\n"
        "dashboard._MASTER_SECONDS = 0.0\n"
        "sys.exit(dashboard.dashboard(['--no-browser', '--port', '0']))\n"
    )
    assert urlopen(link_of(started, "-c", slow), timeout=60).status == 200


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another process")
@pytest.mark.parametrize("host", ["localhost", "robot..local"])  # no encoder of names accepts an empty part
def test_dashboard_without_a_master_ends_with_status_0(
    host: str, started: list[subprocess.Popen[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", f"http://{host}:{free_port()}")
    link_of(started, "-m", "minirospy", "dashboard", "--no-browser", "--port", "0")
    started[0].send_signal(signal.SIGINT)
    assert started[0].wait(60) == 0


@pytest.mark.parametrize("words", [["workshop"], ["--layout", "workshop"]])
def test_layout_of_the_page_is_opened(started: list[subprocess.Popen[str]], words: list[str]) -> None:
    link = link_of(started, "-m", "minirospy", "dashboard", *words, "--no-browser", "--port", "0")
    assert "/#/layout?preset=workshop&token=" in link


def test_port_in_use_is_one_line_and_another_one_is_taken_by_default(
    started: list[subprocess.Popen[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    link, other = (link_of(started, "-m", "minirospy", "dashboard", "--no-browser") for _ in range(2))
    assert link.partition("/#")[0] != other.partition("/#")[0]
    port = link.rpartition(":")[2].partition("/")[0]
    assert command.dashboard(["--no-browser", "--port", port]) == 1
    error = capsys.readouterr().err
    assert f"cannot listen at 127.0.0.1:{port}" in error
    assert error.count("\n") == 1


def test_listening_dashboard_prints_links_with_tokens(started: list[subprocess.Popen[str]]) -> None:
    link = link_of(
        started,
        "-m",
        "minirospy",
        "dashboard",
        "--no-browser",
        "--port",
        "0",
        "--listen",
        "--address",
        "127.0.0.1",
    )
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/#/overview\?token=[\w-]{22}", link)


def test_certificate_makes_the_link_https(started: list[subprocess.Popen[str]], tmp_path: Path) -> None:
    certificate, key = make_certificate(tmp_path)
    link = link_of(
        started,
        *("-m", "minirospy", "dashboard", "--no-browser", "--port", "0"),
        *("--cert", str(certificate), "--key", str(key)),
    )
    assert link.startswith("https://127.0.0.1:")
    context = ssl.create_default_context(cafile=str(certificate))
    with urlopen(link.partition("#")[0], timeout=60, context=context) as answer:
        assert answer.status == 200


def test_host_name_of_a_proxy_is_accepted(started: list[subprocess.Popen[str]]) -> None:
    link = link_of(
        started,
        *("-m", "minirospy", "dashboard", "--no-browser", "--port", "0", "--host-name", "robots.example"),
    )
    port = urlsplit(link).port
    statuses = []
    for host in ("robots.example", "others.example"):
        connection = HTTPConnection("127.0.0.1", port, timeout=60)
        connection.request("GET", "/", headers={"Host": host})
        statuses.append(connection.getresponse().status)
        connection.close()
    assert statuses == [200, 403]


def test_clients_behind_a_proxy_need_the_token(started: list[subprocess.Popen[str]]) -> None:
    link = link_of(
        started,
        *("-m", "minirospy", "dashboard", "--no-browser", "--port", "0", "--host-name", "robots.example"),
    )
    handshake = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
        "Sec-WebSocket-Protocol": "foxglove.sdk.v1",
    }
    statuses = []
    for host in ("robots.example", "127.0.0.1"):
        for token in ({}, {"Authorization": f"Bearer {link.partition('token=')[2]}"}):
            connection = HTTPConnection("127.0.0.1", urlsplit(link).port, timeout=60)
            connection.request("GET", "/", headers={"Host": host, **handshake, **token})
            statuses.append(connection.getresponse().status)
            connection.close()
    assert statuses == [401, 101, 401, 101]


@pytest.mark.parametrize(
    ("run", "words", "text"),
    [
        (command.dashboard, ["tpics"], "there is no view 'tpics'"),
        (command.dashboard, ["--layout", "workshp"], "there is no layout 'workshp'"),
        (command.dashboard, ["plot", "--layout", "teleop"], "'plot' and --layout teleop are two views"),
        (command.dashboard, ["--port", "70000"], "--port 70000 is not between 0 and 65535"),
        (command.dashboard, ["--address", "192.0.2.1"], "--address 192.0.2.1 lets other machines connect"),
        (command.rqt, ["-s", "rqt_moveit"], "there is no view for the plug-in 'rqt_moveit'"),
    ],
)
def test_usage_error_has_status_2(
    run: object, words: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert callable(run)
    assert run(words) == 2
    assert text in capsys.readouterr().err


class Opened(Exception):
    """Makes the command exit when the browser has been opened."""


def test_browser_is_started_with_a_file_without_code_or_token(
    master: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    opened: queue.Queue[str] = queue.Queue()
    pages: list[str] = []

    def open_page(address: str) -> None:
        pages.append(page_at(address).read_text(encoding="utf-8"))
        opened.put(address)

    def announce_end(*words: object, **options: object) -> None:
        if str(words[0]).startswith("The browser opens"):
            opened.put(opened.get(timeout=60))
            raise Opened

    monkeypatch.setattr(browser.webbrowser, "open", open_page)
    monkeypatch.setattr(browser, "has_screen", lambda environ: True)
    monkeypatch.setattr(command, "print", announce_end, raising=False)
    monkeypatch.delenv("WSL_DISTRO_NAME", raising=False)
    monkeypatch.setattr(browser.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(browser, "SNAPS", ())
    with pytest.raises(Opened):
        command.dashboard(["--port", "0"])
    assert "code" not in opened.get()
    link = r"http://127\.0\.0\.1:\d+/#/overview\?code=[\w-]{22}"
    assert re.search(f'url={link}"', pages[0])
    assert re.search(f'href="{link}"', pages[0])
    assert "token" not in pages[0]
    # The dashboard has exited.
    assert not list(tmp_path.iterdir())


def page_at(address: str) -> Path:
    assert address.startswith("file:///"), address
    return Path(url2pathname(urlsplit(address).path))


def test_browser_is_opened_with_a_file_of_this_user_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    opened: queue.Queue[str] = queue.Queue()
    monkeypatch.setattr(browser.webbrowser, "open", opened.put)
    monkeypatch.setattr(browser, "has_screen", lambda environ: True)
    monkeypatch.setattr(browser, "SNAPS", ())
    monkeypatch.delenv("WSL_DISTRO_NAME", raising=False)
    monkeypatch.setattr(browser.tempfile, "tempdir", str(tmp_path))
    remove = open_link("http://127.0.0.1:1/#/plot?path=/a&code=x")
    page = page_at(opened.get(timeout=60))
    assert page.is_relative_to(tmp_path)
    assert 'href="http://127.0.0.1:1/#/plot?path=/a&amp;code=x"' in page.read_text(encoding="utf-8")
    if sys.platform != "win32":
        assert stat.S_IMODE(page.stat().st_mode) == 0o600
        assert stat.S_IMODE(page.parent.stat().st_mode) == 0o700
    assert remove
    remove()
    remove()
    assert not list(tmp_path.iterdir())


def test_browser_without_access_to_temporary_files_gets_one_in_the_home_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(browser, "SNAPS", (Path(sys.executable),))
    monkeypatch.setenv("HOME", str(tmp_path))
    file = browser.LinkFile("http://127.0.0.1:1/")
    (folder,) = tmp_path.iterdir()
    assert file.path.parent == folder
    assert not folder.name.startswith(".")
    file.remove()


def test_no_browser_without_a_screen_or_a_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(browser.webbrowser, "open", pytest.fail)
    monkeypatch.setattr(browser, "has_screen", lambda environ: False)
    assert open_link("http://127.0.0.1:1/") is None
    monkeypatch.setattr(browser, "has_screen", lambda environ: True)
    monkeypatch.setattr(browser, "SNAPS", ())
    monkeypatch.delenv("WSL_DISTRO_NAME", raising=False)
    monkeypatch.setattr(browser.tempfile, "tempdir", str(tmp_path / "missing"))
    assert open_link("http://127.0.0.1:1/") is None


def test_browser_of_windows_gets_the_link_from_wsl(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: queue.Queue[str] = queue.Queue()
    monkeypatch.setattr(browser.webbrowser, "open", opened.put)
    monkeypatch.setenv("WSL_DISTRO_NAME", "Debian")
    assert open_link("http://127.0.0.1:1/#/topics?code=x")
    assert opened.get(timeout=60) == "http://127.0.0.1:1/#/topics?code=x"


def test_screen_is_known_by_the_environment() -> None:
    assert not has_screen({}, "linux")
    assert has_screen({"DISPLAY": ":0"}, "linux")
    assert has_screen({"BROWSER": "firefox"}, "linux")
    assert has_screen({}, "darwin")


@pytest.mark.parametrize(
    ("words", "end"),
    [
        (["rqt", "-s", "rqt_graph", "--clear-config"], "/#/graph"),
        (["rqt_console", "__name:=console"], "/#/console"),
        (
            ["rqt_plot", "-P", "/turtle1/pose/x:y"],
            "/#/plot?path=/turtle1/pose/x&path=/turtle1/pose/y&paused=1",
        ),
        (["rqt_graph"], "/#/graph"),
        (["rqt_bag"], "/#/bag"),
        (["rqt_image_view", "/camera/image_raw"], "/#/image?topic=/camera/image_raw"),
        (["rqt_reconfigure", "lamp"], "/#/reconfigure?node=/lamp"),
        (["rviz", "-f", "odom"], "/#/3d?frame=odom"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_commands_of_rqt_open_their_view(
    started: list[subprocess.Popen[str]], words: list[str], end: str
) -> None:
    program = f"import sys; from minirospy.cli.dashboard import {words[0]}; sys.exit({words[0]}())"
    link = link_of(started, "-c", program, *words[1:], "--no-browser", "--port", "0")
    assert re.sub(r"[?&]token=[\w-]{22}$", "", link).endswith(end)


def test_words_of_rqt_plot_that_are_not_paths_are_usage_errors(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.rqt_plot(["x"]) == 2
    assert "'x' is not a topic and a field, as /turtle1/pose/x" in capsys.readouterr().err


def test_rosrun_finds_the_programs_of_rqt() -> None:
    packages = Packages()
    for name in (*command.COMMANDS, "rqt_gui"):
        if name == "rqt":
            continue
        found = packages.find_executable(name, name)
        assert any(Path(str(word)).name == name for word in found), found
