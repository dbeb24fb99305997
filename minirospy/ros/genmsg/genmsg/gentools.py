"""genmsg.gentools: md5sums and full definitions."""

from __future__ import annotations

from minirospy.core.idl import digest
from minirospy.ros.genmsg.genmsg.msg_loader import MsgContext, lookup_in, parsed_message, parsed_service
from minirospy.ros.genmsg.genmsg.msgs import MsgSpec
from minirospy.ros.genmsg.genmsg.srvs import SrvSpec

__all__ = ["compute_full_text", "compute_md5", "compute_md5_text"]


def compute_md5_text(msg_context: MsgContext, spec: MsgSpec) -> str:
    """Return the text from which a message's md5sum is computed. Raise KeyError if the message uses an unknown message."""
    return digest.md5_text(parsed_message(spec), lookup_in(msg_context))


def compute_md5(msg_context: MsgContext, spec: MsgSpec | SrvSpec) -> str:
    """Return a message's or service's md5sum. Raise KeyError if the definition uses an unknown message."""
    if isinstance(spec, SrvSpec):
        return digest.service_md5(parsed_service(spec.text, spec.full_name), lookup_in(msg_context))
    return digest.message_md5(parsed_message(spec), lookup_in(msg_context))


def compute_full_text(msg_context: MsgContext, spec: MsgSpec | SrvSpec) -> str:
    """Return the full definition of a message or service, as stored in bags: it includes the messages that are used.

    Raise KeyError if :func:`load_depends` has not been called for ``spec``.
    """
    needed = msg_context.get_all_depends(spec.full_name)
    return digest.joined_texts(spec.text, ((name, msg_context.get_registered(name).text) for name in needed))
