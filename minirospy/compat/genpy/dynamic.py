"""genpy.dynamic: message classes from a full text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.errors import DefinitionError

if TYPE_CHECKING:
    from minirospy.idl.protocols import Message

__all__ = ["generate_dynamic"]


def generate_dynamic(core_type: str, msg_cat: str) -> dict[str, type[Message]]:
    """Return the classes of a full text and of all types in it, by name. Raises InvalidMsgSpec."""
    from minirospy.compat.genmsg.base import InvalidMsgSpec
    from minirospy.idl import load

    try:
        return dict(load.classes_from_text(core_type, msg_cat))
    except DefinitionError as error:
        raise InvalidMsgSpec(str(error)) from error
