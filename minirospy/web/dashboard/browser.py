"""Opening a link in the browser of the person at this machine, where there is one.

The link has a secret in it, and every user of the machine may list command lines. So the browser is started with a file that only
this user can read: a page that leads to the link. Browsers send no Referer and no Origin for a page that was opened from a file.
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

_SNAPS = (Path("/snap/bin/firefox"), Path("/snap/bin/chromium"))
"""Browsers that can read neither the temporary folder nor hidden folders, but other files of the home folder."""


def has_screen(environ: Mapping[str, str], platform: str = sys.platform) -> bool:
    """Return whether a browser can show itself: without a screen, a browser of text would take the terminal."""
    if platform in ("win32", "darwin"):
        return True
    return any(environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "WSL_DISTRO_NAME", "BROWSER"))


def link_page(link: str) -> str:
    """Return a page that leads the browser to a link, with a script or without."""
    shown = html.escape(link)
    return (
        '<!doctype html>\n<html><head><meta charset="utf-8"><meta name="referrer" content="no-referrer">\n'
        f'<meta http-equiv="refresh" content="0; url={shown}"><title>minirospy</title></head>\n'
        f'<body><a href="{shown}">minirospy dashboard</a></body></html>\n'
    )


class LinkFile:
    """The page of a link in a folder that only this user may enter."""

    def __init__(self, link: str) -> None:
        """Create the file. Raise OSError."""
        # mkdtemp gives the folder to this user alone, on Windows by its access list.
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
    """Open a link without waiting for the browser; return what removes its file, or None if nothing was opened.

    Nothing is opened without a screen, or if the file cannot be made.
    """
    if not has_screen(os.environ):
        return None
    if os.environ.get("WSL_DISTRO_NAME"):
        # A browser of Windows cannot open a file by its path in Linux.
        return _open(link, lambda: None)
    try:
        file = LinkFile(link)
    except OSError:
        return None
    return _open(file.path.as_uri(), file.remove)


def _open(address: str, remove: Callable[[], object]) -> Callable[[], object]:
    # A browser that starts may block for seconds; one that never returns does not keep this process alive.
    threading.Thread(target=webbrowser.open, args=(address,), name="browser", daemon=True).start()
    return remove


def _parent() -> Path | None:
    """Return where the file's folder is made, None for the system's folder of temporary files."""
    home = Path.home()
    if any(each.exists() for each in _SNAPS) and os.access(home, os.W_OK):
        return home
    return None
