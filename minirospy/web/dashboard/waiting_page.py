"""The page while there is no ROS master: the same files, without data. It explains how to start a master."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from minirospy.base.errors import MasterUnreachableError
from minirospy.web.bridge import BridgeOptions, tls_of
from minirospy.web.dashboard.codes import Codes
from minirospy.web.dashboard.files import handlers, read_folder
from minirospy.web.server.listener import Listener

if TYPE_CHECKING:
    from minirospy.web.server.client import Exchange

__all__ = ["WaitingPage"]


class WaitingPage:
    """Serves the page until the dashboard takes over the port. Meanwhile, open pages try to connect repeatedly."""

    def __init__(
        self, master_uri: str, codes: Codes, options: BridgeOptions, *, embeds: bool = False
    ) -> None:
        self._options = options
        self._listener = Listener(
            [],
            options.access,
            limits=options.limits,
            pages={"/status": partial(_refuse, str(MasterUnreachableError(master_uri)))},
            public_pages={**handlers(read_folder(), embeds=embeds), "/token": codes.serve},
            tls=tls_of(options),
        )

    @property
    def port(self) -> int:
        """Return the page's port. It is known after :meth:`open`."""
        return self._listener.port

    async def open(self) -> None:
        """Start listening. Raise BridgeError if the port cannot be opened."""
        await self._listener.open(self._options.address, self._options.foxglove_port or 0)

    async def close(self) -> None:
        """Free the port. Idempotent."""
        await self._listener.close()


def _refuse(text: str, exchange: Exchange) -> None:
    exchange.respond(503, text.encode(), "text/plain; charset=utf-8")
