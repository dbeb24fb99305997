"""The fleet's contents, announced by liveliness tokens: robots, their gateways, topics and services. Pure.

Tokens arrive and disappear one by one and in any order, so a robot's other tokens may arrive before its claim. Tokens
that exceed the limits, or do not match the formats in :mod:`minirospy.fleet.keys`, are ignored and counted.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import NamedTuple, TypeVar

from minirospy.fleet.holders import Holders
from minirospy.fleet.keys import Claim, ServiceToken, TopicToken, parse_claim, parse_service, parse_topic

_Token = TypeVar("_Token", TopicToken, ServiceToken)

__all__ = ["MAX_GATEWAYS", "MAX_NAMES", "MAX_TOKENS", "FleetContents", "Refused", "Robot"]

MAX_GATEWAYS = 5_000
MAX_NAMES = 2_000  # maximum number of topics, and of services, that a gateway may announce
# maximum number of topics and services of all gateways together; this many use about 100 MiB
MAX_TOKENS = 200_000


@dataclass(frozen=True)
class Robot:
    """A robot, as announced by its gateway. ``duplicates`` are other gateways' claims to the same name, which are ignored."""

    claim: Claim
    topics: dict[str, TopicToken]
    services: dict[str, ServiceToken]
    duplicates: tuple[Claim, ...] = ()


class Refused(NamedTuple):
    """A gateway that :meth:`FleetContents.robots` omits, because another gateway holds its robot's name.

    ``holder`` is the claim that has the name, or had it until recently.
    """

    claim: Claim
    holder: Claim | None


@dataclass(eq=False)
class _Gateway:
    claim: Claim | None = None
    order: int = 0  # sequence number of the claim; later claims have larger numbers
    topics: dict[str, TopicToken] = field(default_factory=dict)
    services: dict[str, ServiceToken] = field(default_factory=dict)

    @property
    def is_empty(self) -> bool:
        return not (self.claim or self.topics or self.services)


class FleetContents:
    """Tracks the existing liveliness tokens and the robots that they announce."""

    def __init__(self, allows: Callable[[str], bool], clock: Callable[[], float] = time.monotonic) -> None:
        """Create a table without tokens.

        ``allows(robot)`` returns whether a robot is of interest; ``clock`` returns monotonic seconds.
        """
        self.holders = Holders(clock)
        self.waiting: tuple[Refused, ...] = ()
        """The gateways that :meth:`robots` omitted because another gateway holds their name."""
        self.refused = 0  # number of tokens ignored so far
        self.refusal = ""  # why the most recent token was ignored
        self._count = 0
        self._allows = allows
        self._orders = itertools.count()
        self._gateways: dict[tuple[str, str], _Gateway] = {}

    def add(self, key: str) -> bool:
        """Add a token; return whether the contents have changed."""
        token = parse_claim(key) or parse_topic(key) or parse_service(key)
        if token is None:
            return self._refuse("a key is not that of a robot, a topic or a service")
        name = token.name if isinstance(token, Claim) else token.robot
        if not self._allows(name):
            return False
        at = (name, token.gateway)
        if at not in self._gateways and len(self._gateways) >= MAX_GATEWAYS:
            return self._refuse(f"the fleet has more than {MAX_GATEWAYS} gateways")

        gateway = self._gateways.get(at) or _Gateway()
        if isinstance(token, Claim):
            if gateway.claim not in (None, token):
                # A gateway declares a single claim, so a different second claim comes from another peer.
                return self._refuse(f"robot [{name}]: two tokens claim to be its gateway {token.gateway}")
            changed = gateway.claim is None
            if changed:
                gateway.claim, gateway.order = token, next(self._orders)
        elif isinstance(token, TopicToken):
            changed = self._put(gateway.topics, token.topic, token)
        else:
            changed = self._put(gateway.services, token.service, token)
        # Do not store a gateway without tokens: it would never be removed, because gateways are removed with their last token.
        if not gateway.is_empty:
            self._gateways[at] = gateway
        return changed

    def remove(self, key: str) -> bool:
        """Remove a token; return whether the contents have changed."""
        token = parse_claim(key) or parse_topic(key) or parse_service(key)
        if token is None:
            return False
        at = (token.name if isinstance(token, Claim) else token.robot, token.gateway)
        gateway = self._gateways.get(at)
        if gateway is None:
            return False

        # If a topic's flags change, the new token arrives before the old one is removed: do not remove the new one.
        if isinstance(token, Claim):
            if gateway.claim != token:
                return False
            gateway.claim = None
        elif isinstance(token, TopicToken):
            if gateway.topics.get(token.topic) != token:
                return False
            del gateway.topics[token.topic]
            self._count -= 1
        else:
            if gateway.services.get(token.service) != token:
                return False
            del gateway.services[token.service]
            self._count -= 1
        if gateway.is_empty:
            del self._gateways[at]
        return True

    @property
    def gateways(self) -> set[str]:
        """Return the gateways that have any tokens."""
        return {gateway for _, gateway in self._gateways}

    def robots(self, lost: Collection[str] = ()) -> dict[str, Robot]:
        """Return the robots, keyed by name, as announced by the gateway that holds each name. Ignore ``lost`` gateways."""
        there = [
            (gateway.order, gateway.claim)
            for gateway in self._gateways.values()
            if gateway.claim and gateway.claim.gateway not in lost
        ]
        claims: dict[str, list[Claim]] = {}
        for _, claim in sorted(there):
            claims.setdefault(claim.name, []).append(claim)

        found: dict[str, Robot] = {}
        waiting = []
        for name, named in sorted(claims.items()):
            best = self.holders.choose(name, named)
            others = tuple(claim for claim in named if claim != best)
            waiting += [Refused(claim, self.holders.holder(name)) for claim in others]
            if best:
                gateway = self._gateways[name, best.gateway]
                found[name] = Robot(best, dict(gateway.topics), dict(gateway.services), others)
        self.holders.forget(claims)
        self.waiting = tuple(waiting)
        return found

    def _put(self, table: dict[str, _Token], name: str, token: _Token) -> bool:
        if name not in table:
            if len(table) >= MAX_NAMES:
                return self._refuse(
                    f"robot [{token.robot}] announces more than {MAX_NAMES} topics or services"
                )
            if self._count >= MAX_TOKENS:
                return self._refuse(f"the fleet announces more than {MAX_TOKENS} topics and services")
            self._count += 1
        changed = table.get(name) != token
        table[name] = token
        return changed

    def _refuse(self, reason: str) -> bool:
        self.refused += 1
        self.refusal = reason
        return False
