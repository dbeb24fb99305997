"""The rate limit for new connections, with a clock that the test controls."""

from __future__ import annotations

from minirospy.web.server.rate import MAX_ADDRESSES, ConnectionRate


class Clock:
    """A clock that the test advances."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_address_may_open_a_burst_and_then_so_many_a_second() -> None:
    clock = Clock()
    rate = ConnectionRate(50, 500, clock)
    assert [rate.admits("a") for _ in range(501)] == [True] * 500 + [False]
    clock.now = 1.0
    assert sum(rate.admits("a") for _ in range(1000)) == 50
    clock.now = 1000.0
    assert sum(rate.admits("a") for _ in range(1000)) == 500


def test_client_of_a_hundred_a_second_is_limited_to_the_rate() -> None:
    clock = Clock()
    rate = ConnectionRate(50, 100, clock)
    admitted = 0
    for number in range(60_000):
        clock.now = number / 100
        admitted += rate.admits("a")
    assert 30_000 <= admitted <= 30_100


def test_other_addresses_have_their_own_rate() -> None:
    rate = ConnectionRate(1, 2, Clock())
    assert [rate.admits("a") for _ in range(3)] == [True, True, False]
    assert rate.admits("b")
    assert not rate.admits("a")


def test_remembered_addresses_are_bounded() -> None:
    rate = ConnectionRate(1, 1, Clock())
    assert all(rate.admits(str(number)) for number in range(10 * MAX_ADDRESSES))
    assert len(rate) == MAX_ADDRESSES
    assert not rate.admits(str(10 * MAX_ADDRESSES - 1))
