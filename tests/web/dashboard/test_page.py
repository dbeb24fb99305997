"""The page over HTTP: headers, compression, ETags, and the files that are served without a token."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest
from websockets.exceptions import InvalidStatus

from minirospy.web.access import Access
from minirospy.web.dashboard.files import FOLDER, SECURITY
from tests.web.conftest import Client

if TYPE_CHECKING:
    from tests.web.dashboard.conftest import Served

INDEX = (FOLDER / "index.html").read_bytes()
GUARDED = Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)


def test_page_is_served_with_its_policy(serve: Callable[..., Served]) -> None:
    answer, body = serve().request("/")
    assert (answer.status, body) == (200, INDEX)
    for name, value in SECURITY.items():
        assert answer.getheader(name) == value
    assert answer.getheader("X-Content-Type-Options") == "nosniff"


def test_page_is_compressed_and_not_sent_twice(serve: Callable[..., Served]) -> None:
    served = serve()
    answer, body = served.request("/js/main.js", Accept_Encoding="gzip, br")
    assert answer.getheader("Content-Encoding") == "gzip"
    assert gzip.decompress(body) == (FOLDER / "js" / "main.js").read_bytes()
    tag = answer.getheader("ETag")
    assert tag
    again, body = served.request("/js/main.js", If_None_Match=tag)
    assert (again.status, body) == (304, b"")


@pytest.mark.parametrize(
    "path",
    [
        "/js",
        "/js/",
        "/js/../js/main.js",
        "/../files.py",
        "/%2e%2e/files.py",
        "//index.html",
        "/vendor/versions.json",
    ],
)
def test_path_that_is_not_a_file_of_the_page_is_not_found(serve: Callable[..., Served], path: str) -> None:
    answer, _ = serve().request(path)
    assert answer.status == 404


def test_page_needs_no_token_and_its_data_do(serve: Callable[..., Served]) -> None:
    served = serve(access=GUARDED)
    assert served.request("/")[0].status == 200
    assert served.request("/status")[0].status == 401
    for path in ("/", "/index.html", "/js/main.js"):
        with pytest.raises(InvalidStatus) as caught:
            Client(served.port, path=path)
        assert caught.value.response.status_code == 401


def test_page_of_another_host_name_is_refused(serve: Callable[..., Served]) -> None:
    answer, body = serve().request("/", Host="evil.example")
    assert answer.status == 403
    assert b"evil.example" in body


def test_data_are_those_of_the_bridge(serve: Callable[..., Served]) -> None:
    served = serve(name="minirospy dashboard")
    client = Client(served.port)
    try:
        info = client.next("serverInfo")
    finally:
        client.close()
    assert info["name"] == "minirospy dashboard"
    assert info["metadata"]["node"] == "/dashboard"
