"""genmsg.srvs: service definitions."""

from __future__ import annotations

from minirospy.ros.genmsg.genmsg.msgs import MsgSpec

__all__ = ["SrvSpec"]


class SrvSpec:
    """A service: its request and response messages."""

    def __init__(
        self,
        request: MsgSpec,
        response: MsgSpec,
        text: str,
        full_name: str = "",
        short_name: str = "",
        package: str = "",
    ) -> None:
        self.request = request
        self.response = response
        self.text = text
        self.full_name = full_name
        self.short_name = short_name
        self.package = package

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SrvSpec) and vars(self) == vars(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"SrvSpec[{self.request!r}, {self.response!r}]"
