"""A board's messages: golden bytes, round trips, and rejected messages."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.board.model import BoardModel, Force, Press, Setup, Write
from minirospy.board.protocol import (
    VERSION,
    Changed,
    Done,
    Hello,
    Message,
    MovePerson,
    PersonMoved,
    ProtocolError,
    Refused,
    Request,
    Stream,
    Welcome,
    decode_board,
    encode_board,
    serialize,
)

MESSAGES: list[Message] = [
    Hello(VERSION, "secret"),
    Request(1, None),
    Request(2, Setup(7, 0)),
    Request(3, Write(((7, 1), (6, 0)))),
    Request(4, Press(11)),
    Request(5, Force(3, 1)),
    Welcome(VERSION, BoardModel().pins, None),
    Welcome(VERSION, BoardModel().pins, (0.5, -1.0)),
    Request(8, MovePerson((0.5, 0.0))),
    Request(9, MovePerson(None)),
    PersonMoved((0.5, 0.0)),
    PersonMoved(None),
    Changed(7, BoardModel().pins[7], True, 12.5),
    Done(5),
    Refused(6, "pin 99 does not exist"),
]


def test_golden_bytes() -> None:
    # [kind 1 = Request, number 7, [operation 1 = Write, [[7, 1]]]]
    assert serialize(Request(7, Write([(7, 1)]))) == bytes.fromhex("93 01 07 92 01 91 92 07 01")
    # [kind 4 = Done, number 5]
    assert serialize(Done(5)) == bytes.fromhex("92 04 05")


@pytest.mark.parametrize("size", [1, 7, 4096])
def test_round_trip_in_pieces_of_any_size(size: int) -> None:
    data = b"".join(map(serialize, MESSAGES))
    stream = Stream()
    got = [
        message for start in range(0, len(data), size) for message in stream.feed(data[start : start + size])
    ]
    assert got == MESSAGES


def test_a_board_is_kept_and_read_back() -> None:
    model = BoardModel()
    model.apply(Setup(7, 0, initial=1))
    assert decode_board(encode_board(model.pins, (0.3, 0.0))) == (model.pins, (0.3, 0.0))


@given(st.binary(max_size=60))
def test_any_bytes_are_messages_or_refused(data: bytes) -> None:
    try:
        list(Stream().feed(data))
    except ProtocolError:
        pass


@pytest.mark.parametrize(
    "block", [b"", b"\x00", b"{}", serialize(Done(1)), serialize(Welcome(VERSION, [], None))]
)
def test_a_spoilt_file_of_a_board_is_refused(block: bytes) -> None:
    with pytest.raises(ProtocolError):
        decode_board(block)
