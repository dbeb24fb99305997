"""The HTTP request that starts a connection: its credentials and fields, and the response to a refused request. Pure.

Source: RFC 9112, RFC 6455 section 4.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import parse_qs, unquote, urlsplit

from minirospy.web.access import Credentials, Refusal, header_items
from minirospy.web.server.client import PLAIN_HEADERS, HttpRequest, response_head

if TYPE_CHECKING:
    from websockets.http11 import Request

    from minirospy.web.server.pipe import Endpoints

__all__ = ["RequestHead", "read_head", "refusal_response"]

_EXTRA_HEADERS: Mapping[int, Mapping[str, str]] = {
    401: {"WWW-Authenticate": "Bearer"},
    503: {"Retry-After": "5"},
}  # additional headers of a refusal, keyed by its status


class RequestHead(NamedTuple):
    """The target and headers of a request. The names of the headers are in lower case."""

    target: str
    headers: Mapping[str, str]

    @property
    def is_page(self) -> bool:
        """Return whether the request is for a page, not for a WebSocket."""
        return self.headers.get("upgrade", "").lower() != "websocket"

    @property
    def credentials(self) -> Credentials:
        """Return the fields that determine the sender's rights. Raise ValueError if Referer is not a URL."""
        return Credentials(
            self.headers.get("host", ""),
            _origin(self.headers),
            self.headers.get("authorization", ""),
            header_items(self.headers, "sec-websocket-protocol"),
            self.target,
        )

    def parsed(self, peer: str, endpoints: Endpoints) -> HttpRequest:
        """Convert the request to the type that sessions and pages receive.

        Raise ValueError if the target is not a URL, or has too many fields.
        """
        parts = urlsplit(self.target)
        fields = parse_qs(parts.query, keep_blank_values=True)
        query = {name: values[-1] for name, values in fields.items()}
        return HttpRequest(unquote(parts.path), query, self.headers, peer, *endpoints)


def read_head(request: Request) -> RequestHead:
    """Return the target and headers of a request. If a header is repeated, the last one is used."""
    return RequestHead(request.path, {name.lower(): value for name, value in request.headers.raw_items()})


def refusal_response(refusal: Refusal) -> tuple[bytes, bytes]:
    """Return the head and the body of the response that refuses a request."""
    body = (refusal.text + "\n").encode()
    headers = {
        **PLAIN_HEADERS,
        "Content-Type": "text/plain; charset=utf-8",
        "Content-Length": str(len(body)),
        **_EXTRA_HEADERS.get(refusal.status, {}),
    }
    return response_head(refusal.status, headers), body


def _origin(headers: Mapping[str, str]) -> str | None:
    """Return the site of the page that sent a request, or None if no page sent it.

    A browser sends the site in Origin, but not for an image or a frame. For these it sends whether the page is from another
    site, and possibly the page's URL in Referer. Source: https://www.w3.org/TR/fetch-metadata/.
    """
    origin = headers.get("origin")
    is_embedded = (
        headers.get("sec-fetch-site") == "cross-site" and headers.get("sec-fetch-dest") != "document"
    )
    if origin is None and is_embedded:
        page = urlsplit(headers.get("referer", ""))
        return f"{page.scheme}://{page.netloc}" if page.netloc else "null"
    return origin
