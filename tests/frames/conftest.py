"""The fixture that starts programs of packages."""

from __future__ import annotations

from tests.robots.conftest import start

__all__ = ["start"]
