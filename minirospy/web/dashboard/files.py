"""The page's files and their HTTP headers. Pure except for reading the folder once.

Requests are served from a table of the folder's files, so that a request cannot name any other file. The page contains no
secrets, so it needs no token, but its WebSocket does. Source: CSP level 3 (w3.org/TR/CSP3).
"""

from __future__ import annotations

import gzip
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.web.server.client import Exchange, HttpHandler

__all__ = ["FOLDER", "SECURITY", "PageFile", "handlers", "read_folder"]

FOLDER = Path(__file__).parent / "page"

_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
}
"""The file types that are served; other files in the folder are not."""

SECURITY = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; worker-src 'self'; connect-src 'self'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
    "Cross-Origin-Resource-Policy": "same-origin",
    # The browser caches the file, but checks its ETag on each start, so that files of different releases are never mixed.
    "Cache-Control": "no-cache",
}
"""The page's security headers: no inline scripts, no content from other sites, no embedding in other pages."""


_NOTEBOOKS = "http://localhost:* http://127.0.0.1:* https://localhost:* https://127.0.0.1:* vscode-webview: vscode-file:"
"""The origins of notebooks on this machine: of JupyterLab, Jupyter Notebook and VS Code."""


@dataclass(frozen=True)
class PageFile:
    """A file of the page: its bytes, plain and gzip-compressed, its media type and its ETag."""

    body: bytes
    packed: bytes
    content_type: str
    tag: str


def read_folder(folder: Path = FOLDER) -> dict[str, PageFile]:
    """Return a dict from request path to file, in which ``/`` is index.html."""
    found = {}
    for path in sorted(folder.rglob("*")):
        content_type = _TYPES.get(path.suffix)
        if content_type is None or not path.is_file():
            continue
        body = path.read_bytes()
        tag = f'"{hashlib.sha256(body).hexdigest()[:20]}"'
        file = PageFile(body, gzip.compress(body, 6, mtime=0), content_type, tag)
        found["/" + path.relative_to(folder).as_posix()] = file
    found["/"] = found["/index.html"]
    return found


def handlers(files: Mapping[str, PageFile], *, embeds: bool = False) -> dict[str, HttpHandler]:
    """Return a request handler for each file. With ``embeds``, notebooks on this machine may embed the page."""
    security = dict(SECURITY)
    if embeds:
        policy = security["Content-Security-Policy"]
        security["Content-Security-Policy"] = policy.replace(
            "frame-ancestors 'none'", f"frame-ancestors {_NOTEBOOKS}"
        )
    headers = {name.replace("-", "_"): value for name, value in security.items()}
    return {path: partial(_serve, file, headers) for path, file in files.items()}


def _serve(file: PageFile, security: Mapping[str, str], exchange: Exchange) -> None:
    headers = {**security, "ETag": file.tag, "Vary": "Accept-Encoding"}
    if file.tag in exchange.request.headers.get("if-none-match", ""):
        exchange.respond(304, b"", file.content_type, **headers)
    elif "gzip" in exchange.request.headers.get("accept-encoding", ""):
        exchange.respond(200, file.packed, file.content_type, Content_Encoding="gzip", **headers)
    else:
        exchange.respond(200, file.body, file.content_type, **headers)
