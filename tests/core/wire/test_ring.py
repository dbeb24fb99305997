"""core/wire/ring: the words of shared memory, and its places against a slow, readable model."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import WireError
from minirospy.core.wire import ring
from minirospy.core.wire.framing import MAX_FRAME, SPLIT
from minirospy.core.wire.large_messages import LargeMessages, parse_large_messages
from minirospy.core.wire.ring import Announcement, Places, Step, layout_for


def test_words_are_no_lengths() -> None:
    words = [ring.PREPARE_WORD, ring.OFFER_WORD, ring.PLACE_WORD]
    assert all(word > MAX_FRAME | SPLIT for word in words)
    assert ring.prepare() == b"\x01\x00\x00\xc0"
    assert ring.offer(ring.PAGE) == b"\x02\x00\x00\xc0\x00\x00\x01\x00"
    assert ring.announcement(1, 2, 3, 4) == b"\3\0\0\xc0\1\0\0\0\2\0\0\0\3\0\0\0\4\0\0\0"
    assert ring.announcement(1, 2) == b"\3\0\0\xc0\1\0\0\0\2\0\0\0\0\0\0\0\0\0\0\0"


def test_announcements_and_offers_are_read_back() -> None:
    data = ring.announcement(65_536, 100_000, 99_000, 900)[4:]
    assert len(data) == ring.ANNOUNCEMENT_BYTES
    assert ring.parse_announcement(data, 200_000) == Announcement(65_536, 100_000, 99_000, 900)
    assert ring.parse_offer(ring.offer(ring.MAX_RING)[4:]) == ring.MAX_RING


@pytest.mark.parametrize(
    ("offset", "size", "array", "rest", "words"),
    [
        (0, 131_073, 0, 0, "outside the ring"),
        (131_072, 1, 0, 0, "outside the ring"),
        (1, 0xFFFFFFFF, 0, 0, "outside the ring"),
        (0xFFFFFFFF, 1, 0, 0, "outside the ring"),
        (0, 100_000, 99_997, 0, "has an array of 99997"),
        (0, 100_000, 99_000, 997, "followed by 997"),
        (0, 100_000, 99_000, 0xFFFFFFFF, "followed by"),
        (0, 100_000, 0, 1, "followed by 1"),
        (0, 3, 1, 0, "has an array of 1"),
    ],
)
def test_an_announcement_outside_the_ring_is_refused(
    offset: int, size: int, array: int, rest: int, words: str
) -> None:
    with pytest.raises(WireError, match=words):
        ring.parse_announcement(ring.announcement(offset, size, array, rest)[4:], 131_072)


@pytest.mark.parametrize(
    ("large", "text"),
    [
        (LargeMessages(118, 120), "; 118 of 120 large messages by shared memory"),
        (
            LargeMessages(0, 3, "the subscriber belongs to another user"),
            "; 0 of 3 large messages by shared memory: the subscriber belongs to another user",
        ),
    ],
)
def test_large_messages_are_read_back_from_a_connections_text(large: LargeMessages, text: str) -> None:
    assert large.text == text
    assert parse_large_messages(f"UNIXROS connection to [unix on socket 9]{text}") == large


@pytest.mark.parametrize(
    "info",
    [
        "",
        "UNIXROS connection to [unix on socket 9]",
        "; 1 of x large messages by shared memory",
        "; 1 of 2 large messages by shared memory: ",
        "; 1 of 2 large messages by shared memory: \x1b[31mred",
        "; 1 of 2 large messages by shared memory: a\nb",
        "; 1 of 2 large messages by shared memory\n",
        f"; 1 of 2 large messages by shared memory: {'x' * 201}",
        f"; {'1' * 19} of 2 large messages by shared memory",
    ],
)
def test_other_texts_of_connections_say_nothing_about_large_messages(info: str) -> None:
    assert parse_large_messages(info) is None


@pytest.mark.parametrize("size", [0, ring.MAX_RING + 1, 0xFFFFFFFF])
def test_a_ring_of_any_size_is_not_mapped(size: int) -> None:
    with pytest.raises(WireError, match="over the limit"):
        ring.parse_offer(ring.offer(size)[4:])


@given(st.integers(1, ring.MAX_MESSAGE))
def test_a_layout_holds_its_message_within_the_limit(size: int) -> None:
    layout = layout_for(size)
    assert size <= layout.place_size
    assert layout.place_size % ring.PAGE == 0
    assert ring.MIN_PLACES <= layout.places <= ring.MAX_PLACES
    assert layout.size <= ring.MAX_RING


def test_only_the_expected_answer_changes_the_step() -> None:
    for step in Step:
        for answer in (ring.READY, ring.MAPPED, ring.REFUSED, b"x"):
            after = ring.ANSWERS.get((step, answer), step)
            assert after is step or step in (Step.ASKED, Step.OFFERED)
    # A subscriber cannot be announced places before it has mapped the ring that was offered last.
    assert [key for key, step in ring.ANSWERS.items() if step is Step.IN_USE] == [(Step.OFFERED, ring.MAPPED)]


def test_the_place_that_became_free_last_is_used_first() -> None:
    places = Places(3)
    first, second = places.take(), places.take()
    assert first is not None
    assert second is not None
    places.let_go(second)
    places.let_go(first)
    assert places.take() == first


def test_a_place_that_was_released_too_early_is_not_taken_back_twice() -> None:
    places = Places(2)
    place = places.take()
    assert place is not None
    places.hold("liar", place, 1)
    assert places.release("liar", 1)
    places.take_back("liar")
    places.let_go(place)
    assert sorted(places.free) == [0, 1]
    places.take_back("stranger")
    assert sorted(places.free) == [0, 1]


def test_a_slow_connection_holds_a_few_places_and_a_few_bytes() -> None:
    places = Places(16)

    def announce(size: int) -> bool:
        if not places.may_hold("slow", size):
            return False
        place = places.take()
        assert place is not None
        places.hold("slow", place, size)
        places.let_go(place)
        return True

    assert [announce(30_000_000) for _ in range(3)] == [True, True, False]
    assert places.release("slow", 2)
    assert [announce(1_000_000) for _ in range(5)] == [True] * 4 + [False]


Operation = tuple[str, int, int]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["publish", "publish", "release", "lie", "take_back"]),
            st.integers(0, 2),
            st.integers(0, 7),
        ),
        max_size=60,
    ),
    st.integers(2, 5),
)
def test_random_operations_against_a_model(operations: list[Operation], count: int) -> None:
    """The model keeps the list of each connection's places. A place with contents that anyone may read is never taken."""
    places = Places(count)
    model: dict[int, list[int]] = {0: [], 1: [], 2: []}

    for name, connection, number in operations:
        if name == "publish":
            # ``number`` has a bit for each connection that the message is announced on.
            place = places.take()
            in_use = {each for held in model.values() for each in held}
            assert (place is None) == (len(in_use) == count)
            if place is None:
                continue
            assert place not in in_use
            for other, held in model.items():
                if number >> other & 1:
                    places.hold(other, place, 1)
                    held.append(place)
            places.let_go(place)
        elif name == "release":
            few = min(number, len(model[connection]))
            assert places.release(connection, few)
            del model[connection][:few]
        elif name == "lie":
            assert not places.release(connection, len(model[connection]) + 1 + number)
        elif model[connection]:
            places.take_back(connection)
            model[connection].pop()

        held_places = Counter(each for held in model.values() for each in held)
        assert sorted([*places.free, *held_places]) == list(range(count))
        assert [places.held_by(each) for each in model] == [len(held) for held in model.values()]
