"""Open a link in the local user's browser, if there is one.

The link contains a secret, and every user of the machine can list command lines. Therefore the browser is started with
a file that only this user can read: a page that redirects to the link. Browsers send neither Referer nor Origin for a
page opened from a file.
"""

from __future__ import annotations

import html
import os
import shutil
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Mapping
from pathlib import Path

from minirospy.base.private_files import create_file

__all__ = ["LinkFile", "has_screen", "link_page", "open_link"]

SNAPS = (Path("/snap/bin/firefox"), Path("/snap/bin/chromium"))
"""Browsers installed as snaps, which can read files in the home folder, but not in hidden or temporary folders."""


def has_screen(environ: Mapping[str, str], platform: str = sys.platform) -> bool:
    """Return whether there is a display. Without one, a text browser would take over the terminal."""
    if platform in ("win32", "darwin"):
        return True
    return any(environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "WSL_DISTRO_NAME", "BROWSER"))


def link_page(link: str) -> str:
    """Return an HTML page that redirects to a link, with or without JavaScript."""
    shown = html.escape(link)
    return (
        '<!doctype html>\n<html><head><meta charset="utf-8"><meta name="referrer" content="no-referrer">\n'
        f'<meta http-equiv="refresh" content="0; url={shown}"><title>minirospy</title></head>\n'
        f'<body><a href="{shown}">minirospy dashboard</a></body></html>\n'
    )


class LinkFile:
    """A page that redirects to a link, in a folder that only this user can access."""

    def __init__(self, link: str) -> None:
        """Create the page's file. Raise OSError if that fails."""
        # Only this user can access a folder made by mkdtemp, on Windows by means of an access control list.
        self._folder = Path(tempfile.mkdtemp(prefix="minirospy-browser-", dir=_parent()))
        self.path = self._folder / "dashboard.html"
        try:
            with os.fdopen(create_file(self.path, 0o600), "w", encoding="utf-8") as file:
                file.write(link_page(link))
        except BaseException:
            self.remove()
            raise

    def remove(self) -> None:
        """Remove the file and its folder. Idempotent."""
        shutil.rmtree(self._folder, ignore_errors=True)


def open_link(link: str) -> Callable[[], object] | None:
    """Open a link without waiting for the browser. Return a function that removes the link's file, or None if nothing is opened.

    Nothing is opened without a display, or if the file cannot be created.
    """
    if not has_screen(os.environ):
        return None
    if os.environ.get("WSL_DISTRO_NAME"):
        # Pass the link itself, because a browser on Windows cannot open a Linux path.
        return _open(link, lambda: None)
    try:
        file = LinkFile(link)
    except OSError:
        return None
    return _open(file.path.as_uri(), file.remove)


def _open(address: str, remove: Callable[[], object]) -> Callable[[], object]:
    # Starting a browser may block for seconds. Use a daemon thread, so that it does not keep this process alive.
    threading.Thread(target=webbrowser.open, args=(address,), name="browser", daemon=True).start()
    return remove


def _parent() -> Path | None:
    """Return the parent folder for the link file's folder, or None for the system's temporary folder."""
    home = Path(os.path.expanduser("~"))  # unlike Path.home(), works for a user without a home folder
    if any(each.exists() for each in SNAPS) and os.access(home, os.W_OK):
        return home
    return None
