"""rosmaster.master: runs a master inside a program, for example for tests."""

from __future__ import annotations

from minirospy.base.environment import DEFAULT_MASTER_PORT, Environment

__all__ = ["DEFAULT_MASTER_PORT", "Master"]


class Master:
    """Serves as a master on ``port`` between :meth:`start` and :meth:`stop`; ``uri`` is its URI.

    It stores nothing on disk.
    """

    def __init__(self, port: int = DEFAULT_MASTER_PORT, num_workers: int = 3) -> None:
        self.port = port
        self.num_workers = num_workers
        self.uri: str | None = None

    def start(self) -> None:
        """Start serving in a thread. Raise OSError if the port is in use."""
        from minirospy.runtime.master.master import Master as Serving
        from minirospy.runtime.transport.access import Access
        from minirospy.runtime.transport.loop import LoopThread

        if self.uri is not None:
            return
        environment = Environment.read()
        serving = Serving(
            host=environment.host,
            bind_host=environment.bind_host,
            port=self.port,
            access=Access.parse(environment.allow),
        )
        self._loop = LoopThread("rosmaster")
        try:
            self._loop.run(serving.start())
        except BaseException:
            self._loop.close()
            raise
        self._serving = serving
        self.port = serving.port
        self.uri = f"http://{environment.uri_host}:{self.port}/"

    def ok(self) -> bool:
        """Return whether the master is serving."""
        return self.uri is not None

    def stop(self) -> None:
        """Stop the master. Idempotent."""
        if self.uri is not None:
            self.uri = None
            self._loop.run(self._serving.close(), 5.0)
            self._loop.close()
