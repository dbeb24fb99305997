"""Selects the gateway that represents a robot if several claim its name: the first one seen, or the operator's choice. Pure.

Peers' clocks do not affect the choice. A machine that holds a name keeps the name until it has been absent for
:data:`HOLD_SECONDS`, so that another machine cannot claim the name during a short loss of the link. A gateway on the same
machine, for example after a restart, replaces the previous one immediately.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from minirospy.fleet.keys import Claim, is_machine

__all__ = ["HOLD_SECONDS", "Holders", "parse_machines"]

HOLD_SECONDS = 10.0  # seconds to reserve a departed robot's name; Zenoh also closes a silent link after 10 s
# maximum number of names reserved for departed robots; limited because peers choose the names
MAX_HOLDS = 5_000


@dataclass
class _Hold:
    claim: Claim
    left: float | None = None
    """The time at which the gateway left, in seconds of the clock; None while it is present."""


class Holders:
    """Decides which gateway represents a robot if several claim its name, and remembers the decision."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """Create an instance in which no name is held. ``clock`` returns monotonic seconds."""
        self.machines: Mapping[str, str] = {}
        """The machines that the operator has chosen, keyed by robot name."""
        self._clock = clock
        self._holds: dict[str, _Hold] = {}
        self._given_up: set[Claim] = set()

    def give_up(self, claim: Claim) -> None:
        """Release the claim of an unresponsive gateway. Another gateway on the same machine may then take the name.

        The gateway's token may still exist.
        """
        self._given_up.add(claim)

    def holder(self, name: str) -> Claim | None:
        """Return the claim that holds a name, even if its gateway left the fleet recently."""
        hold = self._holds.get(name)
        return hold.claim if hold else None

    def choose(self, name: str, claims: Sequence[Claim]) -> Claim | None:
        """Select the claim that holds a name; return None if no claim may hold it now.

        ``claims`` lists the current claims, first seen first.
        """
        present = [claim for claim in claims if claim not in self._given_up] or list(claims)
        machine = self.machines.get(name)
        if machine:
            present = [claim for claim in present if claim.host == machine]
        hold = self._holds.get(name)
        if hold is None or (machine and hold.claim.host != machine):
            return self._hold(name, present)
        if hold.claim in present:
            hold.left = None
            return hold.claim

        successors = [claim for claim in present if claim.host == hold.claim.host]
        if successors:
            return self._hold(name, successors)
        if hold.left is None:
            hold.left = self._clock()
        if self._clock() - hold.left < HOLD_SECONDS:
            return None
        del self._holds[name]
        return self._hold(name, present)

    def forget(self, present: Collection[str]) -> None:
        """Release the names whose holders left more than HOLD_SECONDS ago.

        ``present`` contains the names that are still claimed.
        """
        now = self._clock()
        for name in self._holds.keys() - present:
            hold = self._holds[name]
            if hold.left is None:
                hold.left = now
            elif now - hold.left >= HOLD_SECONDS:
                del self._holds[name]
        for name in list(self._holds.keys() - present)[: max(0, len(self._holds) - MAX_HOLDS)]:
            del self._holds[name]
        if self._given_up:
            self._given_up = {claim for claim in self._given_up if claim.name in present}

    def pause(self, names: Collection[str]) -> float | None:
        """Return the seconds until the first of ``names`` is released, or None if none of their holders has left."""
        ends = [
            hold.left + HOLD_SECONDS
            for name in names
            if (hold := self._holds.get(name)) is not None and hold.left is not None
        ]
        return max(0.0, min(ends) - self._clock()) if ends else None

    def _hold(self, name: str, claims: Sequence[Claim]) -> Claim | None:
        if not claims:
            return None
        self._holds[name] = _Hold(claims[0])
        return claims[0]


def parse_machines(value: object) -> dict[str, str]:
    """Parse the machines chosen by the operator, a dict keyed by robot name. Ignore invalid entries."""
    if not isinstance(value, dict):
        return {}
    return {str(name): machine for name, machine in value.items() if is_machine(machine)}
