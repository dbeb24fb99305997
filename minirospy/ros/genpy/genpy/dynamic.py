"""genpy.dynamic: generate message classes from a full definition."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.base.errors import DefinitionError
from minirospy.ros.genpy.genpy.base import MsgGenerationException

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = ["MsgGenerationException", "generate_dynamic"]


def generate_dynamic(core_type: str, msg_cat: str) -> dict[str, type[Message]]:
    """Generate the classes for all types in a full definition; return them keyed by name.

    Raise InvalidMsgSpec if the definition is invalid, MsgNotFound if a type is missing, MsgGenerationException if a part of
    the definition has no type name.
    """
    from minirospy.core.idl import load

    try:
        return dict(load.classes_from_text(core_type, msg_cat))
    except DefinitionError as error:
        raise _as_genpy(core_type, msg_cat, error) from error


def _as_genpy(core_type: str, msg_cat: str, error: DefinitionError) -> Exception:
    """Return the exception that genpy raises for an invalid full definition."""
    from minirospy.ros.genmsg.genmsg.base import InvalidMsgSpec
    from minirospy.ros.genmsg.genmsg.msg_loader import (
        MsgContext,
        MsgNotFound,
        load_depends,
        load_msg_from_string,
    )

    first, *others = msg_cat.split(f"\n{'=' * 80}\n")
    if not all(part.startswith("MSG:") for part in others):
        return MsgGenerationException(
            "invalid input to generate_dynamic: dependent type is missing 'MSG:' type declaration header"
        )

    context = MsgContext.create_default()
    try:
        specs = [load_msg_from_string(context, first, core_type)]
        for part in others:
            head, _, body = part.partition("\n")
            specs.append(load_msg_from_string(context, body, head.removeprefix("MSG:").strip()))
        for spec in specs:
            load_depends(context, spec, {})
    except (InvalidMsgSpec, MsgNotFound) as found:
        return found
    except (ValueError, RecursionError):
        # Use minirospy's text for an error that genmsg does not detect, such as a message that contains itself.
        pass
    return InvalidMsgSpec(str(error))
