"""A board's server process: `python -m minirospy.board.server FOLDER NAME`.

The first client starts the server, and the server exits shortly after the last client has disconnected; a lock file
ensures that only one server runs. The board is saved to a file when it changes, so that the next server continues with
the same state.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import os
import secrets
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from minirospy.base import private_files
from minirospy.board.directory import BoardDirectory
from minirospy.board.model import BoardModel, Operation, OperationError
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

__all__ = ["main"]

LINGER = 1.5  # seconds for which a board without clients waits for the next one

SAVE_AFTER = 0.05
"""Delay in seconds before a change is saved, so that even a fast-blinking LED causes at most 20 writes a second."""

# Maximum unsent bytes for a client. With more, the server disconnects it; a client that resumes reading reconnects
MAX_UNSENT = 1 << 20

LOCK_PATIENCE = 5.0  # seconds to wait for the lock if another server is about to exit


def main(argv: list[str]) -> int:
    """Serve the board NAME in FOLDER until it has no clients; return 0, also if another server is running."""
    directory = BoardDirectory(argv[1], Path(argv[0]))
    if sys.platform == "win32":
        # Windows only: do not keep the log file open, because an open file and its folder cannot be removed there.
        sys.stderr = _LogOnDemand(directory.log_path)
    # A board with saved state stays permanent, even if a process that wants a temporary board restarts it.
    is_temporary = bool(os.environ.get("MINIROSPY_BOARD_TEMPORARY")) and not directory.state_path.exists()
    with _locked(directory) as owned:
        if owned:
            asyncio.run(_Server(directory).serve())
    if owned and is_temporary:
        for path in (directory.state_path, directory.log_path, directory.lock_path):
            with contextlib.suppress(OSError):
                private_files.remove_file(path)
    return 0


class _LogOnDemand(io.TextIOBase):
    """A standard error stream that opens its file for each write, so that the file exists only after an error."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def write(self, text: str) -> int:
        with contextlib.suppress(OSError), private_files.open_text(self._path, "a") as file:
            file.write(text)
        return len(text)


class _Server:
    def __init__(self, directory: BoardDirectory) -> None:
        self._directory = directory
        self._token = "" if directory.uses_unix_socket else secrets.token_hex(16)
        self._model = _saved(directory)
        self._clients: set[_Client] = set()
        self._abandoned = asyncio.Event()
        self._saving: asyncio.TimerHandle | None = None
        self._leaving: asyncio.TimerHandle | None = None

    async def serve(self) -> None:
        loop = asyncio.get_running_loop()
        self._wait_for_clients()
        if sys.platform != "win32" and self._directory.uses_unix_socket:
            self._directory.socket_path.unlink(missing_ok=True)
            server = await loop.create_unix_server(lambda: _Client(self), self._directory.socket_path)
            address = self._directory.socket_path
        else:
            server = await loop.create_server(lambda: _Client(self), "127.0.0.1", 0)
            address = self._directory.address_path
            _write_private(address, f"{server.sockets[0].getsockname()[1]} {self._token}".encode())
        try:
            await self._abandoned.wait()
        finally:
            server.close()
            # Ignore errors: on Windows, a file that a client has open cannot be removed. The next server replaces it.
            with contextlib.suppress(OSError):
                private_files.remove_file(address)
            for client in list(self._clients):
                client.drop()
            self._save()

    def admits(self, hello: Hello) -> bool:
        return secrets.compare_digest(hello.token.encode(), self._token.encode())

    def join(self, client: _Client) -> None:
        self._clients.add(client)
        if self._leaving is not None:
            self._leaving.cancel()
        client.send(serialize(Welcome(VERSION, self._model.pins, self._model.person)))

    def leave(self, client: _Client) -> None:
        self._clients.discard(client)
        if not self._clients:
            self._wait_for_clients()

    def carry_out(self, request: Request) -> Message:
        """Apply a request and notify all clients; return the response for the client that sent the request."""
        if request.operation is None:
            return Done(request.number)
        try:
            news = b"".join(map(serialize, self._apply(request.operation)))
        except OperationError as error:
            return Refused(request.number, str(error))
        if news:
            for client in list(self._clients):
                client.send(news)
            if self._saving is None:
                self._saving = asyncio.get_running_loop().call_later(SAVE_AFTER, self._save)
        return Done(request.number)

    def _apply(self, operation: Operation | MovePerson) -> list[Message]:
        """Apply an operation and return the messages to send to all clients. Raise OperationError if the operation is invalid."""
        if isinstance(operation, MovePerson):
            return [PersonMoved(operation.position)] if self._model.move_person(operation.position) else []
        now = time.time()
        return [Changed(*change, now) for change in self._model.apply(operation)]

    def _wait_for_clients(self) -> None:
        if self._leaving is not None:
            self._leaving.cancel()
        self._leaving = asyncio.get_running_loop().call_later(LINGER, self._abandoned.set)

    def _save(self) -> None:
        if self._saving is not None:
            self._saving.cancel()
            self._saving = None
        # Ignore errors: clients must not fail because the folder was removed (by a test, or by cleaning /tmp).
        with contextlib.suppress(OSError):
            _write_private(self._directory.state_path, encode_board(self._model.pins, self._model.person))


class _Client(asyncio.Protocol):
    """One connection: reads messages, passes them on, writes responses."""

    def __init__(self, server: _Server) -> None:
        self._server = server
        self._stream = Stream()
        self._admitted = False
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        answers: list[Message] = []
        try:
            for message in self._stream.feed(data):
                self._take(message, answers)
        except ProtocolError:
            self.drop()
            return
        # The last Done covers all earlier requests, so a burst of outputs gets a single response.
        done: list[Message] = [answer for answer in answers if isinstance(answer, Done)]
        refused: list[Message] = [answer for answer in answers if isinstance(answer, Refused)]
        if answers:
            self.send(b"".join(serialize(answer) for answer in [*refused, *done[-1:]]))

    def _take(self, message: Message, answers: list[Message]) -> None:
        if self._admitted and isinstance(message, Request):
            answers.append(self._server.carry_out(message))
        elif not self._admitted and isinstance(message, Hello) and self._server.admits(message):
            self._admitted = True
            self._server.join(self)
        else:
            raise ProtocolError("not now")

    def connection_lost(self, exc: Exception | None) -> None:
        self._server.leave(self)

    def send(self, data: bytes) -> None:
        if self._transport is None or self._transport.is_closing():
            return
        self._transport.write(data)
        if self._transport.get_write_buffer_size() > MAX_UNSENT:
            self.drop()

    def drop(self) -> None:
        if self._transport is not None:
            self._transport.abort()


def _saved(directory: BoardDirectory) -> BoardModel:
    try:
        return BoardModel(*decode_board(directory.state_path.read_bytes()))
    except (OSError, ProtocolError):
        return BoardModel()


def _write_private(path: Path, data: bytes) -> None:
    """Replace ``path`` atomically with a file that only this user can read."""
    fresh = path.with_name(path.name + ".new")
    with os.fdopen(private_files.create_file(fresh), "wb") as file:
        file.write(data)
    private_files.replace_file(fresh, path)


@contextlib.contextmanager
def _locked(directory: BoardDirectory) -> Iterator[bool]:
    """Yield whether this process has acquired the board's lock. Waits briefly for a server that is about to exit."""
    deadline = time.monotonic() + LOCK_PATIENCE
    with os.fdopen(
        private_files.open_file(directory.lock_path, os.O_RDWR | os.O_CREAT, 0o600), "r+b"
    ) as file:
        while not (owned := _try_lock(file.fileno())):
            if time.monotonic() > deadline or _somebody_answers(directory):
                break
            time.sleep(0.02)
        yield owned


def _try_lock(handle: int) -> bool:
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _somebody_answers(directory: BoardDirectory) -> bool:
    return (directory.socket_path if directory.uses_unix_socket else directory.address_path).exists()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
