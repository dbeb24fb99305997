"""Opening a link in the browser of the person at this machine, where there is one."""

from __future__ import annotations

import os
import sys
import threading
import webbrowser
from collections.abc import Mapping

__all__ = ["has_screen", "open_link"]


def has_screen(environ: Mapping[str, str], platform: str = sys.platform) -> bool:
    """Return whether a browser can show itself: without a screen, a browser of text would take the terminal."""
    if platform in ("win32", "darwin"):
        return True
    return any(environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "WSL_DISTRO_NAME", "BROWSER"))


def open_link(link: str) -> bool:
    """Open a link without waiting for the browser; return whether there is a screen for it."""
    if not has_screen(os.environ):
        return False
    # A browser that starts may block for seconds; one that never returns does not keep this process alive.
    threading.Thread(target=webbrowser.open, args=(link,), name="browser", daemon=True).start()
    return True
