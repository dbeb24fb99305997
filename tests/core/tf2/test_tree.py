"""Inserting transforms: which are refused, with which message; and messages that stay bytes until a frame is looked up."""

from __future__ import annotations

import math
import random
import struct
import tracemalloc
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import DeserializationError, ExtrapolationException, TransformException
from minirospy.core.tf2.buffer import TransformBuffer
from minirospy.core.tf2.insertion import Refusal, RefusalLog
from minirospy.core.tf2.pending import Layout, TransformSample
from tests.core.tf2.ours import tf_message

SECOND = 1_000_000_000
STILL = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]


def numbers(x: float) -> list[float]:
    return [x, *STILL[1:]]


def buffer_with_refusals() -> tuple[TransformBuffer, list[Refusal]]:
    refused: list[Refusal] = []
    return TransformBuffer(on_refused=refused.append), refused


@pytest.mark.parametrize(
    ("parent", "child", "values", "texts"),
    [
        (
            "a",
            "/a",
            STILL,
            [
                'TF_SELF_TRANSFORM: Ignoring transform from authority "/me" with frame_id and child_frame_id  "a" '
                "because they are the same"
            ],
        ),
        (
            "a",
            "",
            STILL,
            ['TF_NO_CHILD_FRAME_ID: Ignoring transform from authority "/me" because child_frame_id not set '],
        ),
        (
            "",
            "b",
            STILL,
            [
                'TF_NO_FRAME_ID: Ignoring transform with child_frame_id "b"  from authority "/me" because frame_id '
                "not set"
            ],
        ),
        (
            "a",
            "b",
            [math.nan, *STILL[1:]],
            [
                'TF_NAN_INPUT: Ignoring transform for child_frame_id "b" from authority "/me" because of a nan value '
                "in the transform (nan 0.000000 0.000000) (0.000000 0.000000 0.000000 1.000000)"
            ],
        ),
        (
            "a",
            "b",
            [*STILL[:6], 1.1],
            [
                'TF_DENORMALIZED_QUATERNION: Ignoring transform for child_frame_id "b" from authority "/me" because of '
                "an invalid quaternion in the transform (0.000000 0.000000 0.000000 1.100000)"
            ],
        ),
    ],
)
def test_wrong_transforms_are_refused_with_the_text_of_tf2(
    parent: str, child: str, values: list[float], texts: list[str]
) -> None:
    buffer, refused = buffer_with_refusals()
    buffer.insert_message(tf_message((parent, child, SECOND, values)), "/me")
    assert [refusal.text for refusal in refused] == texts
    assert all(refusal.is_error for refusal in refused)
    assert buffer.frame_names() == []


def test_nan_in_a_rotation_is_two_faults() -> None:
    buffer, refused = buffer_with_refusals()
    buffer.insert("a", "b", SECOND, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, math.nan), "/me")
    assert [refusal.kind for refusal in refused] == ["TF_NAN_INPUT", "TF_DENORMALIZED_QUATERNION"]


def test_old_and_repeated_data_are_warnings() -> None:
    buffer, refused = buffer_with_refusals()
    for stamp in (20, 20, 9):
        buffer.insert("a", "b", stamp * SECOND, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), "/me")
    assert [refusal.text for refusal in refused] == [
        "TF_REPEATED_DATA ignoring data with redundant timestamp for frame b (parent a) at time 20.000000 according to "
        "authority /me",
        "TF_OLD_DATA ignoring data from the past (Possible reasons are listed at "
        "http://wiki.ros.org/tf/Errors%20explained) for frame b (parent a) at time 9.000000 according to authority /me",
    ]


def test_refusals_of_one_frame_are_written_once_a_second_with_a_count() -> None:
    times = [0.0]
    written: list[tuple[str, bool]] = []
    log = RefusalLog(lambda text, is_error: written.append((text, is_error)), lambda: times[-1])
    repeated = Refusal("b", "TF_REPEATED_DATA", "TF_REPEATED_DATA ...", False)

    for seconds in (0.0, 0.3, 0.9, 0.99):
        times.append(seconds)
        log(repeated)
    log(Refusal("c", "TF_REPEATED_DATA", "of c", False))
    times.append(1.5)
    log(repeated)
    assert written == [
        ("TF_REPEATED_DATA ...", False),
        ("of c", False),
        ("TF_REPEATED_DATA ... (3 more like it in 2 s)", False),
    ]


def test_refusals_of_many_frames_use_little_memory() -> None:
    log = RefusalLog(lambda *_: None, lambda: 0.0)
    for number in range(5000):
        log(Refusal(f"f{number}", "TF_NAN_INPUT", "", True))
    assert len(log._written) <= 1000


# --- lazily

FRAMES = ["a", "b", "c", "d"]
transforms = st.tuples(
    st.sampled_from(FRAMES[:3]),
    st.sampled_from(FRAMES),
    st.integers(1, 40).map(lambda n: n * SECOND // 2),
    st.floats(-5, 5).map(numbers) | st.just([math.nan, *STILL[1:]]) | st.just([*STILL[:6], 2.0]),
)


def test_a_frame_whose_first_transform_was_refused_has_its_next_one() -> None:
    buffer = TransformBuffer()
    sound = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    buffer.insert_message(tf_message(("a", "b", SECOND, sound)), "/me")
    buffer.insert_message(tf_message(("b", "a", 2 * SECOND, [math.nan, *sound[1:]])), "/me")
    buffer.insert_message(tf_message(("b", "a", 3 * SECOND, sound)), "/me")
    assert buffer.lookup("a", "a", 0).stamp == 3 * SECOND


@given(
    st.lists(
        st.tuples(st.lists(transforms, min_size=1, max_size=3), st.sampled_from(["/one", "/two"]))
        | st.tuples(st.sampled_from(FRAMES), st.sampled_from(FRAMES)),
        max_size=40,
    )
)
def test_messages_kept_as_bytes_are_as_good_as_inserted_ones(steps: list[tuple[object, str]]) -> None:
    lazy, eager = TransformBuffer(), TransformBuffer()
    for what, who in steps:
        if isinstance(what, list):
            lazy.insert_message(tf_message(*what), who)
            for parent, child, stamp, (x, y, z, *rest) in what:
                qx, qy, qz, qw = rest
                eager.insert(parent, child, stamp, (x, y, z), (qx, qy, qz, qw), who)
            continue
        for time in (0, 5 * SECOND, 7 * SECOND + 1):
            answers = []
            for buffer in (lazy, eager):
                try:
                    answers.append(str(buffer.lookup(str(what), who, time)))
                except TransformException as error:
                    answers.append(str(error))
            assert answers[0] == answers[1]

    assert lazy.frame_names() == eager.frame_names()
    assert lazy.frames_as_string() == eager.frames_as_string()
    for mine, other in zip(lazy.frames(), eager.frames(), strict=True):
        assert mine.authority == other.authority
        assert (mine.cache is None) == (other.cache is None)
        if mine.cache is not None and other.cache is not None:
            assert (len(mine.cache), mine.cache.oldest, mine.cache.newest) == (
                len(other.cache),
                other.cache.oldest,
                other.cache.newest,
            )


@pytest.mark.parametrize("seed", range(20))
def test_long_streams_kept_as_bytes_are_as_good_as_inserted_ones(seed: int) -> None:
    """The streams include expiry, dropped blocks, frames that do not move, and samples that are late, repeated or wrong."""
    rng = random.Random(seed)
    span = rng.choice([SECOND, 5 * SECOND])
    lazy, eager = TransformBuffer(span), TransformBuffer(span)
    stuck = rng.random() < 0.5
    for n in range(1, 800):
        transforms = []
        for parent, child in (("a", "b"), ("b", "c"), ("b", "d")):
            late = rng.choice([0, 0, 0, 1, 3]) if rng.random() < 0.3 else 0
            stamp = SECOND if child == "d" and stuck else max(1, n - late) * SECOND // 50
            values = numbers(float(n)) if rng.random() < 0.98 else [math.nan, *STILL[1:]]
            transforms.append((parent, child, stamp, values))
        lazy.insert_message(tf_message(*transforms), "/me")
        for parent, child, stamp, (x, y, z, *rest) in transforms:
            qx, qy, qz, qw = rest
            eager.insert(parent, child, stamp, (x, y, z), (qx, qy, qz, qw), "/me")
        if rng.random() < 0.05:
            target, source = rng.sample(["a", "b", "c", "d"], 2)
            time = rng.choice([0, rng.randrange(1, 17 * SECOND)])
            answers = []
            for buffer in (lazy, eager):
                try:
                    answers.append(str(buffer.lookup(target, source, time)))
                except TransformException as error:
                    answers.append(str(error))
            assert answers[0] == answers[1]
    assert kept(lazy) < 300 + 3 * 64
    assert lazy.frames_as_string() == eager.frames_as_string()


def stream(buffer: TransformBuffer, count: int, step: int = SECOND // 100) -> None:
    for n in range(1, count + 1):
        stamp = n * step
        buffer.insert_message(
            tf_message(
                ("a", "b", stamp, numbers(n)), ("b", "c", stamp, numbers(1)), ("b", "d", stamp, STILL)
            ),
            "/me",
        )


def kept(buffer: TransformBuffer) -> int:
    return sum(len(layout._arrivals) for layout in buffer._layouts)


def test_message_of_a_known_layout_is_not_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    buffer = TransformBuffer()
    stream(buffer, 1)
    decoded: list[str] = []
    take = Layout.take

    def counted(self: Layout, child: str) -> Iterator[tuple[int, str, TransformSample]]:
        decoded.append(child)
        return take(self, child)

    monkeypatch.setattr(Layout, "take", counted)
    stream(buffer, 50)
    assert kept(buffer) == 50
    assert decoded == []
    assert buffer.lookup("a", "c", 0).translation == (51.0, 0.0, 0.0)
    assert set(decoded) == {"b", "c"}


def test_kept_messages_are_bounded_by_the_cache_time() -> None:
    buffer = TransformBuffer()
    stream(buffer, 5000)
    assert 1000 <= kept(buffer) <= 1000 + 2 * 64
    with pytest.raises(ExtrapolationException, match=r"but the earliest data is at time 40\.0"):
        buffer.lookup("a", "c", 39 * SECOND)
    assert buffer.lookup("a", "c", 40 * SECOND).translation == (4001.0, 0.0, 0.0)


def test_messages_whose_stamps_stand_still_do_not_fill_the_memory() -> None:
    refused: list[Refusal] = []
    buffer = TransformBuffer(on_refused=refused.append)
    for _ in range(1000):
        buffer.insert_message(tf_message(("a", "b", SECOND, STILL), ("b", "c", SECOND, STILL)), "/me")
    assert kept(buffer) <= 2 * 64
    assert {refusal.kind for refusal in refused} == {"TF_REPEATED_DATA"}


def test_a_frame_whose_stamp_stands_still_does_not_keep_the_others() -> None:
    buffer = TransformBuffer()
    for n in range(1, 5000):
        stamp = n * SECOND // 100
        buffer.insert_message(tf_message(("a", "b", stamp, numbers(n)), ("b", "fixed", SECOND, STILL)))
    assert 900 <= kept(buffer) <= 1000 + 2 * 64
    assert buffer.lookup("a", "b", 40 * SECOND).translation == (4000.0, 0.0, 0.0)
    assert buffer.lookup("b", "fixed", 0).stamp == SECOND


def test_data_decoded_by_all_frames_is_released() -> None:
    buffer = TransformBuffer(cache_time=1000 * SECOND)
    for _ in range(10):
        stream(buffer, 64)
        buffer.frames_as_string()
    assert kept(buffer) <= 2 * 64


def test_more_messages_than_any_use_are_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.core.tf2.pending.MAX_MESSAGES", 256)
    buffer = TransformBuffer(cache_time=1000 * SECOND)
    stream(buffer, 1000)
    assert kept(buffer) <= 256 + 64
    assert buffer.lookup("a", "c", SECOND // 100).translation == (2.0, 0.0, 0.0)


def test_kept_messages_do_not_expire_by_a_message_that_is_refused() -> None:
    buffer = TransformBuffer()
    stream(buffer, 100)
    for n in range(64 * 3):
        buffer.insert_message(
            tf_message(
                ("a", "b", (100 + n) * SECOND, [math.nan, *STILL[1:]]),
                ("b", "c", (100 + n) * SECOND, numbers(1)),
                ("b", "d", (100 + n) * SECOND, STILL),
            )
        )
    assert buffer.lookup("a", "b", 0) == (SECOND, (100.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def test_many_frames_each_in_messages_of_their_own() -> None:
    buffer = TransformBuffer()
    tracemalloc.start()
    for n in range(3):
        for frame in range(10_000):
            buffer.insert_message(tf_message(("map", f"frame{frame}", (n + 1) * SECOND, numbers(n))))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100e6
    assert len(buffer.frame_names()) == 10_001
    assert buffer.lookup("map", "frame9999", 0).translation == (2.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "data",
    [b"", b"\1\0\0", b"\1\0\0\0", tf_message(("a", "b", 5, STILL))[:-1], struct.pack("<I", 1 << 31)],
)
def test_bytes_that_are_not_a_message_are_refused(data: bytes) -> None:
    buffer = TransformBuffer()
    with pytest.raises(DeserializationError):
        buffer.insert_message(data)
    assert buffer.frame_names() == []
    buffer.insert_message(tf_message())
    assert buffer.frame_names() == []


@given(st.binary(max_size=300))
def test_any_bytes_are_taken_or_refused(data: bytes) -> None:
    buffer = TransformBuffer()
    for each in (data, data):
        try:
            buffer.insert_message(each)
        except DeserializationError:
            pass


def test_clearing_forgets_what_is_kept() -> None:
    buffer = TransformBuffer()
    stream(buffer, 10)
    buffer.insert("a", "s", 0, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), is_static=True)
    buffer.clear()
    assert kept(buffer) == 0
    assert buffer.why_not("a", "c", 0)
    assert buffer.why_not("a", "s", 5) is None
    stream(buffer, 2)
    assert buffer.lookup("a", "c", 0).stamp == 2 * SECOND // 100
