"""A server's clients share its event loop: the order of their work, with a clock that the test controls."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING

import pytest

from minirospy.web.server.turns import NEW_PIECES, SLICE_SECONDS, FairTurns, cpu_meter

if TYPE_CHECKING:
    from minirospy.web.server.turns import Share


class Machine:
    """A clock, a loop's iterations, and clients whose work takes time."""

    def __init__(self, turn: float = 0.004, slice_: float = 0.001) -> None:
        self.now = 100.0
        self.soon: list[Callable[[], None]] = []
        self.done: list[str] = []
        self.left: dict[str, int] = {}
        self.seconds: dict[str, float] = {}
        self.shares: dict[str, Share] = {}
        self.turns = FairTurns(self.soon.append, lambda: self.now, turn=turn, slice_=slice_)

    def join(self, name: str, seconds: float) -> None:
        def work(end: float) -> bool:
            while self.left[name]:
                self.left[name] -= 1
                self.done.append(name)
                self.now += self.seconds[name]
                if self.now >= end:
                    break
            return bool(self.left[name])

        self.left[name], self.seconds[name] = 0, seconds
        self.shares[name] = self.turns.join(work)

    def send(self, name: str, pieces: int) -> bool:
        self.left[name] += pieces
        return self.turns.start(self.shares[name])

    def iterate(self) -> list[str]:
        """Run a loop iteration; return the clients whose work ran, in order."""
        before = len(self.done)
        ready, self.soon[:] = list(self.soon), []
        for function in ready:
            function()
        return self.done[before:]


def test_little_work_is_done_immediately() -> None:
    machine = Machine()
    machine.join("a", 0.0001)
    assert not machine.send("a", 1)
    assert machine.done == ["a"]
    assert not machine.soon
    machine.now += 1
    assert not machine.send("a", 5)
    assert machine.done == ["a"] * 6


def test_work_of_all_clients_in_one_iteration_is_bounded() -> None:
    machine = Machine()
    names = [f"c{number}" for number in range(250)]
    for name in names:
        machine.join(name, 0.0005)
    start = machine.now
    for name in names:
        machine.send(name, 100)
    # Two pieces of work fill a slice, after which the other clients are queued; four use up the credit of one turn.
    assert machine.now - start <= 0.005
    for _ in range(20):
        start = machine.now
        assert machine.iterate()
        assert machine.now - start <= 0.005


@pytest.mark.parametrize(("weight", "most"), [(1.0, 251), (16.0, 17)])
def test_client_that_sends_little_waits_for_a_slice_of_each_other_at_most(weight: float, most: int) -> None:
    machine = Machine()
    machine.join("good", 0.0002)
    machine.shares["good"].weight = weight
    machine.send("good", 1)
    names = [f"bad{number}" for number in range(250)]
    for name in names:
        machine.join(name, 0.001)
        machine.send(name, 100_000)
    for _ in range(200):
        machine.iterate()

    waits = []
    for _ in range(50):
        machine.send("good", 1)
        before = len(machine.done)
        while "good" not in machine.done[before:]:
            machine.iterate()
        waits.append(machine.done[before:].index("good"))
        for _ in range(100):
            machine.iterate()
    assert max(waits) <= most


def test_client_that_sends_little_does_not_wait_for_the_first_long_message_of_each_other() -> None:
    machine = Machine()
    machine.join("good", 0.0002)
    for _ in range(20):
        machine.send("good", 1)
        machine.now += 0.05
    names = [f"bad{number}" for number in range(250)]
    for name in names:
        machine.join(name, 0.014)
        machine.send(name, 100_000)
    for _ in range(50):
        machine.send("good", 1)
        before = len(machine.done)
        while "good" not in machine.done[before:]:
            machine.iterate()
        assert machine.done[before:].index("good") <= 12
        for _ in range(3):
            machine.iterate()


def test_new_client_is_not_preferred_to_one_that_has_been_idle() -> None:
    machine = Machine()
    machine.join("good", 0.0001)
    machine.join("busy", 0.001)
    machine.send("good", 1)
    machine.send("busy", 10_000)
    for _ in range(10):
        machine.iterate()
    for number in range(100):
        machine.join(f"new{number}", 0.001)
        machine.send(f"new{number}", 10)
    machine.send("good", 1)
    assert machine.iterate()[0] == "good"


def test_clients_that_send_much_get_equal_parts() -> None:
    machine = Machine()
    machine.join("short", 0.0002)
    machine.join("long", 0.003)
    machine.send("short", 100_000)
    machine.send("long", 100_000)
    for _ in range(2000):
        machine.iterate()
    short, long = (machine.done.count(name) * seconds for name, seconds in (("short", 2), ("long", 30)))
    assert abs(short - long) <= 60


def test_client_that_has_left_is_not_called_again() -> None:
    machine = Machine()
    for name in ("a", "b"):
        machine.join(name, 0.01)
    assert machine.send("a", 3)
    assert machine.send("b", 3)
    machine.turns.leave(machine.shares["b"])
    assert len(machine.turns) == 1
    machine.join("c", 0.01)
    assert machine.send("c", 0)
    assert len(machine.turns) == 2
    for _ in range(5):
        machine.iterate()
    assert machine.done == ["a", "a", "a"]
    assert machine.send("b", 1) is False
    assert not machine.soon


def test_work_waits_for_its_turn_beyond_half_of_the_time() -> None:
    for interval, is_immediate in ((0.0021, True), (0.0019, False)):
        machine = Machine()
        machine.join("a", 0.001)
        are_queued = set()
        for _ in range(200):
            are_queued.add(machine.send("a", 1))
            if machine.left["a"]:
                machine.iterate()
            machine.now += interval - 0.001
        assert are_queued == ({False} if is_immediate else {False, True})


def test_work_waits_for_its_turn_when_its_time_is_used_up_exactly() -> None:
    machine = Machine(turn=1.0, slice_=1.0)
    machine.join("a", 1.0)
    assert not machine.send("a", 1)
    machine.seconds["a"] = 2.0
    # The credit is 0.5 s, then 1.5 s less, then it is 0.
    assert not machine.send("a", 1)
    machine.now += 1.0
    assert machine.send("a", 1)
    assert machine.iterate() == ["a"]


def test_start_of_a_queued_client_has_no_effect() -> None:
    machine = Machine()
    machine.join("a", 0.001)
    assert machine.send("a", 3)
    assert machine.send("a", 0) is True
    assert len(machine.turns) == len(machine.soon) == 1
    machine.iterate()
    assert machine.done == ["a"] * 3
    assert len(machine.turns) == 0


def test_work_that_is_started_by_other_work_waits_for_its_turn() -> None:
    machine = Machine()
    machine.join("b", 0.0001)

    def start_other(_: float) -> bool:
        assert machine.send("b", 1)
        assert not machine.done
        return False

    assert not machine.turns.start(machine.turns.join(start_other))
    assert machine.iterate() == ["b"]


def test_iteration_ends_when_its_time_has_passed() -> None:
    machine = Machine(turn=4.0, slice_=1.0)
    machine.join("a", 1.0)
    machine.send("a", 100)
    assert len(machine.iterate()) == len(machine.iterate()) == 4


@pytest.mark.parametrize(
    ("bursts", "weight", "slices"),
    [
        ([], 1.0, 1),
        ([1], 1.0, 1),
        ([1, 1], 1.0, 2),
        ([1, 1, 1], 1.0, 3),
        ([1] * 10, 1.0, 10),
        ([1] * 30, 1.0, 10),
        ([10], 1.0, 1),
        ([10, 10], 1.0, 2),
        ([11], 1.0, -1),
        ([11, 1], 1.0, 1),
        ([11, 1, 1], 1.0, 2),
        ([1, 1, 11, 1], 1.0, 1),
        ([], 2.0, 2),
        ([20, 20], 2.0, 4),
        ([21], 2.0, -1),
    ],
)
def test_short_bursts_allow_as_many_slices(bursts: list[int], weight: float, slices: int) -> None:
    """A client is interactive for this many slices of a burst; after a long burst, it is not interactive at all."""
    machine = Machine(turn=1000.0, slice_=1.0)
    machine.join("hog", 1.0)
    machine.join("a", 1.0)
    machine.shares["a"].weight = weight
    for burst in bursts:
        machine.send("a", burst)
        while machine.left["a"]:
            machine.iterate()
        machine.now += 10_000
    machine.send("hog", 3)  # so that the next work does not start immediately
    first = machine.shares["a"]
    kinds = []
    work = first.work

    def noting(end: float) -> bool:
        kinds.append(first.queue is machine.turns._interactive)
        return work(end)

    first.work = noting
    machine.send("a", 50)
    while machine.left["a"]:
        machine.iterate()
    assert kinds == [True] * (slices + 1) + [False] * (49 - slices)


def test_weight_divides_the_time() -> None:
    machine = Machine()
    for name, weight in (("light", 1.0), ("heavy", 3.0)):
        machine.join(name, 0.001)
        machine.shares[name].weight = weight
        machine.send(name, 100_000)
    for _ in range(1000):
        machine.iterate()
    assert 2.9 <= machine.done.count("heavy") / machine.done.count("light") <= 3.1


def test_weight_divides_the_expected_time() -> None:
    machine = Machine(turn=4.0, slice_=1.0)
    for name, seconds in (("light", 1.0), ("heavy", 2.0), ("hog", 1.0)):
        machine.join(name, seconds)
    machine.shares["heavy"].weight = 4.0
    for name in ("light", "heavy"):
        for _ in range(NEW_PIECES):
            machine.send(name, 1)
            machine.now += 100
    machine.send("hog", 5)
    machine.send("light", 1)
    machine.send("heavy", 1)
    assert [name for name in machine.iterate() + machine.iterate() if name != "hog"] == ["heavy", "light"]


def test_known_clients_have_their_own_expected_time() -> None:
    """Until a client is known, its work is expected to take as long as that of other new clients."""
    for pieces, is_first in ((NEW_PIECES - 1, False), (NEW_PIECES, True)):
        machine = Machine(turn=8.0, slice_=1.0)
        for name, seconds in (("new", 3.0), ("slow", 2.0), ("quick", 1.0), ("hog", 1.0)):
            machine.join(name, seconds)
        for name, count in (("slow", NEW_PIECES), ("quick", pieces), ("new", 1)):
            for _ in range(count):
                machine.send(name, 1)
                machine.now += 100
        machine.send("hog", 2)
        machine.send("slow", 1)
        machine.send("quick", 1)
        order = [name for name in machine.iterate() if name != "hog"]
        assert order == (["quick", "slow"] if is_first else ["slow", "quick"])


@pytest.mark.parametrize(("seconds", "order"), [(2.5, ["new", "other", "known"]), (2.75, ["new", "known"])])
def test_queued_new_client_is_expected_to_take_longer_if_another_does(
    seconds: float, order: list[str]
) -> None:
    """It moves back in the queue if the difference exceeds a slice."""
    machine = Machine(turn=4.0, slice_=1.0)
    machine.join("known", 1.5)
    for _ in range(NEW_PIECES):
        machine.send("known", 1)
        machine.now += 100
    # After these pieces, only this client itself is expected to take longer.
    machine.seconds["known"] = 2.0
    while not machine.send("known", 1):
        pass
    machine.join("new", seconds)
    machine.join("other", 1.0)
    machine.send("new", 1)
    machine.send("other", 1)
    assert machine.iterate()[: len(order)] == order


def test_client_of_the_other_queue_starts_at_the_tag_that_is_served() -> None:
    """The time that it used among bulk clients does not count among interactive clients."""
    machine = Machine(turn=4.0, slice_=1.0)
    machine.join("a", 0.5)
    machine.join("hog", 1.0)
    names = [f"c{number}" for number in range(4)]
    for name in names:
        machine.join(name, 2.0)
        for _ in range(NEW_PIECES):
            machine.send(name, 1)
            machine.now += 100
    machine.send("a", 2000)
    while machine.left["a"]:
        machine.iterate()
    machine.now += 100
    assert not machine.send("a", 1)
    machine.send("hog", 1000)
    for name in (*names, "a"):
        machine.send(name, 1)
    order: list[str] = []
    while machine.left["a"]:
        order += machine.iterate()
    assert next(name for name in order if name != "hog") == "a"


def test_clients_start_at_the_highest_tag_if_none_waits() -> None:
    machine = Machine()
    machine.join("busy", 0.009)
    for name, seconds, pieces in (("idle", 0.0006, 10), ("good", 0.0005, 40)):
        machine.join(name, seconds)
        for _ in range(pieces):
            machine.send(name, 1)
            machine.now += 1
    machine.send("busy", 2)
    machine.send("idle", 1)
    machine.send("good", 1)
    machine.done.clear()
    while machine.left["busy"]:
        machine.iterate()
    assert machine.done[:2] == ["good", "idle"]


def test_client_that_was_idle_has_no_advantage_over_those_that_were_not() -> None:
    machine = Machine()
    for name in ("first", "second", "idle"):
        machine.join(name, 0.001)
    machine.send("idle", 20)
    while machine.left["idle"]:
        machine.iterate()
    for name in ("first", "second"):
        machine.send(name, 100_000)
    for _ in range(1000):
        machine.iterate()
    machine.send("idle", 1000)
    machine.done.clear()
    for _ in range(75):
        machine.iterate()
    assert 98 <= machine.done.count("idle") <= 102


def test_fault_does_not_end_turns() -> None:
    """Work that starts after a fault does not count as work started by other work."""
    machine = Machine()
    machine.join("a", 0.0001)

    def fail(_: float) -> bool:
        raise ValueError("a fault")

    assert not machine.turns.start(machine.turns.join(fail))
    assert not machine.send("a", 1)
    assert machine.done == ["a"]


def test_meter_is_the_threads_time_if_that_is_fine_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    for resolution, meter in (
        (1e-9, time.thread_time),
        (SLICE_SECONDS / 10.5, time.thread_time),
        (SLICE_SECONDS / 10, time.monotonic),
        (0.016, time.monotonic),
    ):
        infos = {"thread_time": SimpleNamespace(resolution=resolution)}
        monkeypatch.setattr(time, "get_clock_info", infos.__getitem__)
        assert cpu_meter() is meter


def test_fault_of_one_client_leaves_the_others_their_turns(caplog: pytest.LogCaptureFixture) -> None:
    machine = Machine()
    machine.join("good", 0.01)

    def fail(_: float) -> bool:
        raise ValueError("a fault")

    bad = machine.turns.join(fail)
    machine.send("good", 3)
    assert machine.turns.start(bad)
    for _ in range(6):
        machine.iterate()
    assert machine.done == ["good"] * 3
    assert "a fault" in caplog.text


def test_client_is_not_charged_while_other_processes_run() -> None:
    now, used = 100.0, 0.0
    soon: list[Callable[[], None]] = []
    done: list[str] = []
    turns = FairTurns(soon.append, lambda: now, meter=lambda: used, turn=0.004, slice_=0.001)

    def join(name: str, cpu: float, wall: float) -> Share:
        def work(_: float) -> bool:
            nonlocal now, used
            done.append(name)
            now, used = now + wall, used + cpu
            return True

        return turns.join(work)

    unlucky, greedy = join("unlucky", 0.001, 0.5), join("greedy", 0.003, 0.003)
    turns.start(unlucky)
    turns.start(greedy)
    while len(done) < 101:
        soon.pop(0)()
    assert done.count("unlucky") > 2 * done.count("greedy")


def test_interactive_client_goes_before_clients_whose_work_is_never_done() -> None:
    """The interactive client goes first even if it uses more than its equal share of the time.

    Its requests take longer than a slice.
    """
    machine = Machine()
    machine.join("good", 0.003)
    for number in range(250):
        machine.join(f"bad{number}", 0.0005)
        machine.send(f"bad{number}", 100_000)
    while len(machine.done) < 250 * 30:
        machine.iterate()

    for _ in range(50):
        machine.send("good", 1)
        before = len(machine.done)
        while "good" not in machine.done[before:]:
            machine.iterate()
        # The client waits for the rest of the bulk clients' slices, not for a slice of each.
        assert machine.done[before:].index("good") <= 12
        machine.iterate()


@pytest.mark.parametrize("seconds", [0.0005, 0.02])
def test_bulk_clients_have_a_fifth_of_the_time_at_least(seconds: float) -> None:
    machine = Machine()
    machine.join("bulk", seconds)
    machine.send("bulk", 1_000_000)
    for _ in range(50):
        machine.iterate()
    names = [f"c{number}" for number in range(20)]
    for name in names:
        machine.join(name, 0.001)
    before, start = machine.done.count("bulk"), machine.now
    while machine.now - start < 20:
        for name in names:
            if not machine.left[name]:
                machine.send(name, 1)
        machine.iterate()
    part = seconds * (machine.done.count("bulk") - before) / (machine.now - start)
    assert 0.19 <= part <= 0.24


def test_bulk_client_becomes_interactive_after_a_short_burst() -> None:
    machine = Machine()
    machine.join("a", 0.001)
    machine.join("bulk", 0.001)
    machine.send("a", 11)
    machine.send("bulk", 10_000)
    while machine.left["a"]:
        machine.iterate()
    for _ in range(20):
        machine.iterate()
    # The client's burst exceeded ten slices, so it waits like the other client; after that, it no longer waits.
    waits = []
    for _ in range(2):
        machine.send("a", 1)
        before = len(machine.done)
        while machine.left["a"]:
            machine.iterate()
        waits.append(machine.shares["a"].queue is machine.shares["bulk"].queue)
        assert machine.done[before:].index("a") <= 2
    assert waits == [True, False]


def test_new_clients_start_at_the_same_tag_if_none_waits() -> None:
    machine = Machine()
    for name, seconds in (("idle", 0.0006), ("good", 0.0005)):
        machine.join(name, seconds)
        for _ in range(10):
            machine.send(name, 1)
            machine.now += 1
    machine.join("busy", 0.009)
    machine.send("busy", 2)
    machine.send("idle", 1)
    machine.send("good", 1)
    machine.done.clear()
    while machine.left["busy"]:
        machine.iterate()
    # The client that needs less goes first: the time that it used before it was idle does not count.
    assert machine.done[:2] == ["good", "idle"]


def test_known_client_goes_before_new_ones_that_have_had_a_slice() -> None:
    """250 clients that start to flood the server together do not delay a client that has sent short requests before."""
    machine = Machine()
    machine.join("good", 0.002)
    for _ in range(10):
        machine.send("good", 1)
        machine.now += 0.05
    for number in range(250):
        machine.join(f"bad{number}", 0.001)
        machine.send(f"bad{number}", 100_000)
    while len(set(machine.done)) < 251:
        machine.iterate()

    waits = []
    for _ in range(20):
        machine.send("good", 1)
        before = len(machine.done)
        while machine.left["good"]:
            machine.iterate()
        waits.append(machine.done[before:].index("good"))
        machine.iterate()
    assert max(waits) <= 12
