"""The queue for a slow client: limited, drops a topic's oldest message first, and always has the newest."""

from __future__ import annotations

import tracemalloc
from io import BytesIO
from typing import BinaryIO

from hypothesis import given
from hypothesis import strategies as st

from minirospy.web.server.account import LARGE_PIECE, Account
from minirospy.web.server.files import FileAnswer
from minirospy.web.server.queue import DEFAULT_LIMIT, ENTRY_BYTES, MAX_ANSWERS, SendQueue

LIMIT = 1_000_000  # bytes in a queue that a test fills


def drained(queue: SendQueue) -> list[bytes]:
    found = []
    while (pieces := queue.pop()) is not None:
        found.append(b"".join(pieces))
    return found


def test_messages_leave_in_the_order_of_arrival() -> None:
    queue = SendQueue()
    queue.put("a", (b"1", b"2"))
    queue.put_answer((b"answer",))
    queue.put("b", (b"3",))
    assert drained(queue) == [b"12", b"answer", b"3"]
    assert (queue.sent, queue.sent_bytes, queue.size, queue.answers) == (2, 3, 0, 0)


def test_full_queue_drops_the_oldest_of_the_same_topic() -> None:
    queue = SendQueue(limit=10, entry_bytes=0)
    queue.put("small", (b"s",))
    for number in range(5):
        queue.put("image", (b"%d..." % number,))
    assert drained(queue) == [b"s", b"3...", b"4..."]
    assert queue.dropped == 3
    assert queue.dropped_of == {"image": 3}


def test_replaced_message_does_not_count_as_dropped() -> None:
    """/clock with 250 messages a second would warn about each page that is busy for a moment."""
    queue = SendQueue()
    for number in range(5):
        queue.put("time", (b"%d" % number,), newest_only=True)
    assert drained(queue) == [b"4"]
    assert (queue.dropped, queue.dropped_of) == (0, {})


def test_new_topic_displaces_the_one_that_holds_most() -> None:
    queue = SendQueue(limit=10, entry_bytes=0)
    queue.put("image", (b"11111",))
    queue.put("small", (b"s",))
    queue.put("image", (b"2222",))
    queue.put("other", (b"o",))
    assert drained(queue) == [b"s", b"2222", b"o"]


def test_message_larger_than_the_bound_waits_alone() -> None:
    queue = SendQueue(limit=10, entry_bytes=0)
    queue.put("small", (b"s",))
    queue.put("cloud", (bytes(50),))
    queue.put("cloud", (bytes(60),))
    assert drained(queue) == [bytes(60)]


def test_only_the_newest_message_waits_on_request() -> None:
    queue = SendQueue()
    for number in range(4):
        queue.put("time", (b"%d" % number,), newest_only=True)
    assert drained(queue) == [b"3"]


def test_discarded_topic_leaves_nothing_behind() -> None:
    queue = SendQueue(limit=10, entry_bytes=0)
    for _ in range(4):
        queue.put("a", (b"aaaa",))
    queue.put("b", (b"b",))
    queue.discard("a")
    assert queue.size == 1
    assert not queue.dropped_of
    assert drained(queue) == [b"b"]


def test_answers_are_kept_and_their_overrun_is_visible() -> None:
    queue = SendQueue(limit=10, entry_bytes=0)
    piece = bytes(1_000_000)
    while not queue.is_overrun:
        queue.put_answer((piece,))
    assert queue.answers == MAX_ANSWERS + len(piece)
    assert queue.dropped == 0


def test_small_messages_wait_in_no_more_memory_than_large_ones() -> None:
    tracemalloc.start()
    try:
        memory = [filled(size) for size in (1, 100, 10_000)]
    finally:
        tracemalloc.stop()
    assert all(each <= 1.2 * LIMIT for each in memory), memory


def filled(size: int) -> int:
    """Return the memory of a queue that is full of messages of this size."""
    before, _ = tracemalloc.get_traced_memory()
    queue = SendQueue(LIMIT)
    while not queue.dropped:
        queue.put("a", (bytes(15), bytearray(size)))
    return tracemalloc.get_traced_memory()[0] - before


def test_unread_small_answers_are_an_overrun() -> None:
    queue = SendQueue()
    while not queue.is_overrun:
        queue.put_answer((b"1",))
    assert len(queue) < MAX_ANSWERS / 300


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(1, 12)) | st.none()), st.integers(5, 30))
def test_bound_holds_and_counts_add_up(steps: list[tuple[str, int] | None], limit: int) -> None:
    queue = SendQueue(limit, entry_bytes=0)
    put = popped = 0
    newest: dict[str, int] = {}
    for number, step in enumerate(steps):
        if step is None:
            popped += queue.pop() is not None
            continue
        key, size = step
        queue.put(key, (bytes([number % 256]) * size,))
        newest[key] = number % 256
        put += 1
        assert queue.size <= max(limit, size)
        waiting = [pieces for each, pieces, _ in queue._entries.values() if each == key]
        assert waiting[-1][0][0] == newest[key], "the newest is not dropped"
    assert put == popped + queue.dropped + len(queue)
    drained(queue)
    assert queue.size == 0
    assert not queue._waiting


def test_cleared_queue_holds_nothing() -> None:
    queue = SendQueue(10, entry_bytes=0)
    queue.put("a", (b"12345",))
    queue.put_answer((b"123",))
    queue.clear()
    assert (len(queue), queue.size, queue.answers, queue.dropped) == (0, 0, 0, 0)
    queue.put("a", (b"12",), newest_only=True)
    assert queue.pop() == (b"12",)
    assert queue.pop() is None
    assert queue.dropped == 0


def test_messages_are_dropped_without_the_answers() -> None:
    queue = SendQueue()
    for key in ("a", "b", "a"):
        queue.put(key, (key.encode(),))
    queue.put_answer((b"answer",))
    queue.drop_messages()
    assert (queue.size, queue.dropped, queue.dropped_of) == (0, 3, {"a": 2, "b": 1})
    assert drained(queue) == [b"answer"]


def test_files_are_answers_of_small_size() -> None:
    queue = SendQueue()
    opened: list[str] = []

    def file(name: str) -> FileAnswer:
        def open_() -> tuple[BinaryIO, int]:
            opened.append(name)
            return BytesIO(), 0

        return FileAnswer(open_, lambda _: b"", lambda _: b"")

    answers = [file("a"), file("b")]
    queue.put_file(answers[0])
    queue.put_answer((b"answer",))
    queue.put_file(answers[1])
    assert (len(queue), queue.size, queue.large) == (3, 0, 0)
    assert 0 < queue.answers < 10_000
    assert [queue.pop() for _ in range(4)] == [answers[0], (b"answer",), answers[1], None]
    assert (queue.answers, queue.sent, opened) == (0, 0, [])


def test_limits_are_those_that_are_documented() -> None:
    assert (DEFAULT_LIMIT, MAX_ANSWERS, ENTRY_BYTES) == (10_000_000, 64_000_000, 350)


def test_messages_may_fill_the_bound_exactly() -> None:
    queue = SendQueue(limit=10, entry_bytes=2)
    queue.put("a", (b"123",))
    queue.put("b", (b"456",))
    assert (queue.size, queue.dropped) == (10, 0)
    queue.put("b", (b"789",))
    assert (queue.size, queue.dropped) == (10, 1)
    assert drained(queue) == [b"123", b"789"]
    for data in (b"123", b"456"):
        queue.put("a", (data,))
    assert drained(queue) == [b"123", b"456"]


def test_piece_is_large_from_exactly_that_size() -> None:
    account = Account()
    queue = SendQueue(entry_bytes=0, share=account.open("a", lambda: None))
    queue.put("a", (bytes(LARGE_PIECE),))
    queue.put_answer((bytes(LARGE_PIECE),))
    assert (queue.large, account.total) == (2 * LARGE_PIECE, 2 * LARGE_PIECE)
    queue.put("a", (bytes(LARGE_PIECE),), newest_only=True)
    assert account.total == 2 * LARGE_PIECE
    assert queue.pop() == (bytes(LARGE_PIECE),)
    assert (queue.large, account.total) == (LARGE_PIECE, LARGE_PIECE)
    queue.pop()
    assert (queue.large, account.total) == (0, 0)
