"""Files that are sent in pieces: all bytes arrive, only one piece is in memory, and failures are reported."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import pytest

from minirospy.base.errors import BridgeError
from minirospy.web.server.files import PIECE_BYTES, FileAnswer, FileSender
from minirospy.web.server.queue import SendQueue

if TYPE_CHECKING:
    from tests.web.conftest import Running


def answer_of(file: BinaryIO, size: int) -> FileAnswer:
    return FileAnswer(
        lambda: (file, size), lambda size: b"%d:" % size, lambda why: b"failed: " + why.encode()
    )


def sent(answer: FileAnswer) -> tuple[list[bytes], FileSender]:
    """Return a file's pieces for a client that accepts each piece immediately."""

    async def run() -> tuple[list[bytes], FileSender]:
        ready = asyncio.Event()
        sender = FileSender(answer, asyncio.get_running_loop(), ready.set)
        found: list[bytes] = []
        while not (sender.is_done or sender.has_failed):
            piece = sender.take()
            if piece is None:
                await asyncio.wait_for(ready.wait(), 60)
                ready.clear()
            else:
                found.append(piece)
        return found, sender

    return asyncio.run(run())


@pytest.mark.parametrize("size", [0, 1, PIECE_BYTES - 1, PIECE_BYTES, PIECE_BYTES + 1, 3 * PIECE_BYTES])
def test_file_is_sent_in_pieces(size: int) -> None:
    data = bytes(range(256)) * (size // 256) + bytes(size % 256)
    file = BytesIO(data)
    pieces, sender = sent(answer_of(file, size))
    assert b"".join(pieces) == b"%d:" % size + data
    assert max(map(len, pieces)) <= PIECE_BYTES + 20
    assert file.closed
    assert not sender.has_failed


def test_file_that_has_grown_is_sent_as_it_was_announced() -> None:
    pieces, _ = sent(answer_of(BytesIO(b"123456"), 4))
    assert b"".join(pieces) == b"4:1234"


def test_file_that_has_become_shorter_fails(caplog: pytest.LogCaptureFixture) -> None:
    file = BytesIO(bytes(PIECE_BYTES))
    pieces, sender = sent(answer_of(file, PIECE_BYTES + 1))
    assert sender.has_failed
    assert not sender.is_done
    assert file.closed
    assert len(b"".join(pieces)) == PIECE_BYTES + len(b"131073:")
    assert "a file could not be sent: it has become shorter meanwhile" in caplog.text


def test_file_that_cannot_be_opened_is_answered() -> None:
    def refuse() -> tuple[BinaryIO, int]:
        raise BridgeError("no such file")

    pieces, sender = sent(FileAnswer(refuse, lambda _: b"", lambda why: why.encode()))
    assert pieces == [b"no such file"]
    assert sender.is_done


def test_file_is_closed_when_its_reading_ends_after_the_client() -> None:
    async def run() -> None:
        file, calls = BytesIO(bytes(10)), []
        sender = FileSender(answer_of(file, 10), asyncio.get_running_loop(), lambda: calls.append(1))
        assert sender.take() is None
        sender.close()
        reading = sender._reading
        assert reading
        await reading
        await asyncio.sleep(0)
        assert file.closed
        assert not calls
        assert sender.take() is None

    asyncio.run(run())


def test_files_wait_unopened_in_their_order() -> None:
    queue = SendQueue()
    answer = answer_of(BytesIO(), 0)
    queue.put_answer((b"first",))
    queue.put_file(answer)
    queue.put("topic", (b"last",))
    assert queue.answers > 1000
    assert [queue.pop(), queue.pop(), queue.pop(), queue.pop()] == [(b"first",), answer, (b"last",), None]
    assert queue.answers == 0
    queue.put_file(answer)
    queue.clear()
    assert (queue.answers, queue.pop()) == (0, None)


def test_client_gets_meshes_and_what_is_sent_between_them(
    run_bridge: Callable[..., Running], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "arm"
    package.mkdir()
    (package / "package.xml").write_text("<package><name>arm</name></package>")
    meshes = [bytes([number]) * (number * 1_000_000) for number in range(4)]
    for number, data in enumerate(meshes):
        (package / f"{number}.stl").write_bytes(data)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    client = run_bridge().client()
    for number in range(4):
        client.send(op="fetchAsset", uri=f"package://arm/{number}.stl", requestId=number)
        client.send(op="getParameters", parameterNames=["/none"], id=str(number))
    for number, data in enumerate(meshes):
        assert client.next_binary(4) == struct.pack("<BIBI", 4, number, 0, 0) + data
        client.next("parameterValues", lambda each, number=number: each.get("id") == str(number))
