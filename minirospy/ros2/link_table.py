"""Opens and closes links of one kind (topics, services or actions) to match the wanted links."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import MinirospyError, ROSException
from minirospy.base.escape import escaped
from minirospy.ros2.action_links import ActionLink
from minirospy.ros2.layouts import TypesDiffer
from minirospy.ros2.links import Link
from minirospy.ros2.service_links import ServiceLink

__all__ = ["LinkTable", "OpenLink", "Pair", "pairs"]

_L = TypeVar("_L", Link, ServiceLink, ActionLink)
_O = TypeVar("_O", bound="OpenLink")


class OpenLink(Protocol):
    """A link that forwards messages, calls or goals from :meth:`open` to :meth:`close`. ``close`` is always called."""

    async def open(self) -> None: ...

    async def close(self) -> None: ...


@dataclass(frozen=True)
class Pair:
    """A link that should be bridged, and the reason if that is impossible, or "" if it is possible."""

    link: Link | ServiceLink | ActionLink
    reason: str = ""


def pairs(wanted: Iterable[_L], check: Callable[[_L], object]) -> list[Pair]:
    """Pair each link with the message of the TypesDiffer that ``check(link)`` raises, or with "" if ``check`` raises no error."""
    found = []
    for link in wanted:
        try:
            check(link)
        except TypesDiffer as error:
            found.append(Pair(link, str(error)))
        else:
            found.append(Pair(link))
    return found


class LinkTable(Generic[_L, _O]):
    """The open links, and the reasons why other wanted links could not be opened. ``make(link)`` may raise TypesDiffer.

    Runs on the node's loop.
    """

    def __init__(self, log: logging.Logger, make: Callable[[_L], _O]) -> None:
        self.links: dict[_L, _O] = {}
        self.refused: dict[_L, str] = {}
        self._log = log
        self._reporter = ErrorReporter(log, "closing a link")
        self._make: Callable[[_L], _O] = make

    async def update(self, wanted: Collection[_L]) -> bool:
        """Close links that are no longer wanted, and open new ones. Return whether any link was opened or closed."""
        gone = [link for link in self.links if link not in wanted]
        for link in gone:
            await self._close(link)

        self.refused = {link: reason for link, reason in self.refused.items() if link in wanted}
        new = [link for link in wanted if link not in self.links and link not in self.refused]
        for link in new:
            try:
                await self._open(link)
            except (TypesDiffer, ROSException, ValueError) as error:
                self._refuse(link, str(error))
            except MinirospyError:
                raise  # a call to the master failed, so the caller retries
            except Exception as error:  # noqa: BLE001 - rclpy may raise any error; still open the other links
                self._refuse(link, f"{type(error).__name__}: {' '.join(str(error).split())}")
        return bool(gone or new)

    async def close(self) -> None:
        """Close all links. Idempotent."""
        for link in list(self.links):
            await self._close(link)

    async def _open(self, link: _L) -> None:
        opened = self._make(link)
        try:
            await opened.open()
        except BaseException:
            await opened.close()
            raise
        self.links[link] = opened
        self._log.info(
            "bridging %s (%s): [%s] and [%s]",
            link.title,
            link.direction.value,
            link.ros1_type,
            link.ros2_type,
        )

    def _refuse(self, link: _L, reason: str) -> None:
        self.refused[link] = reason
        self._log.warning("%s is not bridged (%s): %s", link.title, link.direction.value, escaped(reason))

    async def _close(self, link: _L) -> None:
        try:
            await self.links.pop(link).close()
        except Exception as error:  # noqa: BLE001 - rclpy may raise any error; still close the other links
            self._reporter.report(error)
        self._log.info("no longer bridging %s (%s)", link.title, link.direction.value)
