"""Which connection is closed for a new one: silent, idle and greedy connections, by address and rights."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from minirospy.web.access import Grant
from minirospy.web.server.admission import (
    FEW,
    IDLE_SECONDS,
    MAX_SILENT,
    SILENT_SECONDS,
    Rank,
    displaced,
    rank_of,
)

NOW = 1000.0


@dataclass(frozen=True)
class Seat:
    """A connection with the time in seconds since its last activity."""

    peer: str
    rank: Rank
    ago: float

    @property
    def active(self) -> float:
        return NOW - self.ago


def choose(occupants: list[Seat], peer: str = "new", rank: Rank = Rank.WRITE) -> Seat | None:
    return displaced(peer, rank, iter(occupants), NOW)


def test_rights_are_ranks() -> None:
    assert [rank_of(grant) for grant in (Grant.READ, Grant.WRITE, Grant.OWN)] == [
        Rank.READ,
        Rank.WRITE,
        Rank.OWN,
    ]
    assert Rank.SILENT < Rank.READ < Rank.WRITE < Rank.OWN


@pytest.mark.parametrize("rank", list(Rank))
def test_active_clients_are_not_displaced_by_a_stranger(rank: Rank) -> None:
    assert choose([], rank=rank) is None
    active = [Seat(f"a{number}", Rank.OWN, 0.0) for number in range(20)]
    assert choose(active, rank=rank) is None


def test_oldest_silent_connection_gives_way_first() -> None:
    old, older = Seat("a", Rank.SILENT, SILENT_SECONDS), Seat("b", Rank.SILENT, SILENT_SECONDS + 1)
    idle = Seat("c", Rank.READ, 500.0)
    assert choose([idle, old, older]) is older
    assert choose([idle, old], rank=Rank.SILENT) is old
    young = Seat("a", Rank.SILENT, SILENT_SECONDS - 0.1)
    assert choose([young], rank=Rank.SILENT) is None
    assert choose([young, idle], rank=Rank.SILENT) is None
    assert choose([young, idle]) is idle


def test_address_with_too_many_silent_connections_loses_the_oldest() -> None:
    young = [Seat("a", Rank.SILENT, 1.0 + number / 100) for number in range(MAX_SILENT)]
    others = [Seat("b", Rank.SILENT, 4.0)]
    assert choose([*young, *others], rank=Rank.SILENT) is None
    young.append(Seat("a", Rank.SILENT, 0.5))
    assert choose([*others, *young], rank=Rank.SILENT) is young[MAX_SILENT - 1]
    # If two addresses have too many of them, the address with more connections is chosen.
    more = [Seat("c", Rank.SILENT, 0.1) for _ in range(MAX_SILENT + 2)]
    assert choose([*young, *more], rank=Rank.SILENT) in more


def test_longest_idle_client_of_the_heaviest_address_gives_way() -> None:
    few = [Seat("few", Rank.WRITE, 900.0)]
    many = [Seat("many", Rank.WRITE, IDLE_SECONDS + number) for number in range(3)]
    active = [Seat(f"active{number}", Rank.WRITE, IDLE_SECONDS - 1) for number in range(5)]
    assert choose([*few, *many, *active]) is many[-1]
    assert choose([*few, *active]) is few[0]
    assert choose(active) is None


def test_client_gives_way_to_equal_or_higher_rights_alone() -> None:
    reader, writer, owner = (Seat("a", rank, 100.0) for rank in (Rank.READ, Rank.WRITE, Rank.OWN))
    assert choose([writer, owner], rank=Rank.READ) is None
    assert choose([reader], rank=Rank.READ) is reader
    assert choose([owner], rank=Rank.WRITE) is None
    assert choose([writer], rank=Rank.WRITE) is writer
    assert choose([owner], rank=Rank.OWN) is owner


def test_address_with_more_than_half_gives_way_to_one_with_few() -> None:
    greedy = [Seat("greedy", Rank.WRITE, number / 10) for number in range(9)]
    others = [Seat(f"b{number}", Rank.WRITE, 5.0) for number in range(7)]
    assert choose([*greedy, *others]) is greedy[-1]
    # More than an eighth of the connections no longer counts as few.
    newcomers = [Seat("new", Rank.WRITE, 5.0) for _ in range(2)]
    assert choose([*greedy, *others[:5], *newcomers]) is None
    assert choose([*greedy, *others[:6], newcomers[0]]) is greedy[-1]
    # Half is not more than half.
    assert choose([*greedy[:8], *others, Seat("c", Rank.WRITE, 0.0)]) is None
    assert choose([*greedy, *others], rank=Rank.READ) is None
    # The owner's programs have the same address.
    owners = [Seat("greedy", Rank.OWN, 1.0) for _ in range(20)]
    assert choose([*owners, *others], rank=Rank.WRITE) is None
    assert choose([*owners, greedy[3], *others], rank=Rank.WRITE) is greedy[3]


def test_owner_takes_the_place_of_any_stranger() -> None:
    active = [Seat("many", Rank.WRITE, number / 10) for number in range(3)]
    other = Seat("other", Rank.READ, 20.0)
    owner = Seat("many", Rank.OWN, 25.0)
    assert choose([*active, other, owner], rank=Rank.OWN) is active[-1]
    assert choose([other, owner], rank=Rank.OWN) is other
    assert choose([Seat("a", Rank.SILENT, 0.0), owner], rank=Rank.OWN) == Seat("a", Rank.SILENT, 0.0)
    assert choose([owner], rank=Rank.OWN) is None


def test_limits_are_those_that_are_documented() -> None:
    assert (SILENT_SECONDS, MAX_SILENT, IDLE_SECONDS, FEW) == (5.0, 16, 30.0, 8)


def test_client_is_idle_after_exactly_that_time() -> None:
    idle = Seat("a", Rank.WRITE, IDLE_SECONDS)
    others = [Seat(f"b{number}", Rank.WRITE, 0.0) for number in range(20)]
    assert choose([*others, idle]) is idle


def test_silent_connection_is_not_taken_for_an_idle_client() -> None:
    silent = [Seat("a", Rank.SILENT, SILENT_SECONDS - 1) for _ in range(9)]
    others = [Seat(f"b{number}", Rank.WRITE, 0.0) for number in range(7)]
    assert choose([*silent, *others]) is None
