"""The dashboard's page behind other servers: below a path of a reverse proxy, by another host name, over TLS, without a token."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from std_msgs.msg import Bool

from minirospy.runtime.transport.loop import LoopThread
from minirospy.web.access import Access
from tests.interop.browser import Page
from tests.interop.test_interop_dashboard import browse, needs_chromium, publisher
from tests.web.dashboard.conftest import TOKEN, Served, serve
from tests.web.test_web import make_certificate

__all__ = ["browse", "serve"]

GUARDED = Access(read_token="read-token-00", write_token=TOKEN, requires_token=True)


class Proxy:
    """A reverse proxy that serves another server below the path ``/ros/``, and keeps the Host header."""

    def __init__(self, port: int) -> None:
        self._upstream = port
        self.port = 0
        self._tasks: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        self._server.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        try:
            head = await reader.readuntil(b"\r\n\r\n")
            if not head.startswith(b"GET /ros/"):
                writer.write(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
                return
            upstream_reader, upstream = await asyncio.open_connection("127.0.0.1", self._upstream)
            try:
                # Each connection carries one request, so that all further data belong to it.
                head = re.sub(rb"(?i)connection: keep-alive", b"Connection: close", head)
                upstream.write(head.replace(b"GET /ros/", b"GET /", 1))
                await asyncio.gather(_copy(reader, upstream), _copy(upstream_reader, writer))
            finally:
                upstream.close()
        except (asyncio.IncompleteReadError, ConnectionError):
            pass
        finally:
            writer.close()


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(65536):
        writer.write(data)
        await writer.drain()
    writer.close()


@pytest.fixture
def proxy() -> Iterator[Callable[[int], Proxy]]:
    """Return a function that starts a proxy before the server on a port."""
    loop = LoopThread("test-proxy")
    started: list[Proxy] = []

    def start(port: int) -> Proxy:
        started.append(Proxy(port))
        loop.run(started[-1].start())
        return started[-1]

    yield start
    for each in started:
        loop.run(each.close())
    loop.close()


@needs_chromium
def test_page_works_below_a_path_of_a_proxy_with_another_host_name(
    serve: Callable[..., Served], proxy: Callable[[int], Proxy], browse: Callable[..., Page]
) -> None:
    # The fixtures end in reverse order: a page that is still open when its proxy ends logs errors.
    served = serve(access=Access(write_token=TOKEN, requires_token=True, hosts=("robots.example",)))
    served.run(publisher(served, "/button_state", Bool, latch=True).publish(True))
    page = browse(
        f"http://robots.example:{proxy(served.port).port}/ros/#/topics?token={TOKEN}",
        flags=("--host-resolver-rules=MAP robots.example 127.0.0.1",),
    )
    page.wait_text("#state", "connected")
    page.wait_text(".topic", "/button_state")
    assert page.errors == []


@needs_chromium
def test_page_is_served_over_tls(
    serve: Callable[..., Served], browse: Callable[..., Page], tmp_path: Path
) -> None:
    certificate, key = make_certificate(tmp_path)
    served = serve(certificate=str(certificate), key=str(key))
    page = browse(
        f"https://127.0.0.1:{served.port}/#/topics?token={TOKEN}", flags=("--ignore-certificate-errors",)
    )
    page.wait_text("#state", "connected")


@needs_chromium
@pytest.mark.parametrize(
    ("word", "text"),
    [
        (
            "",
            "a token is required: the bridge prints it when it starts. Open the link that the command has printed",
        ),
        (
            "?token=wrong-token-0",
            "this token is wrong: the bridge prints the right one when it starts. Open the link",
        ),
    ],
)
def test_page_without_its_token_says_so(
    serve: Callable[..., Served], browse: Callable[..., Page], word: str, text: str
) -> None:
    served = serve(access=GUARDED)
    page = browse(f"http://127.0.0.1:{served.port}/#/topics{word}")
    page.wait_text(".notice", text)
    page.open("about:blank")
    page.open(f"http://127.0.0.1:{served.port}/#/topics?token={TOKEN}")
    page.wait_text("#state", "connected")
    page.wait("return !document.querySelector('.notice')")
