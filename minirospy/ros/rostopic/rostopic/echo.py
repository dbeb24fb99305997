"""A class that prints messages in user code, as a subscriber's callback or as a base class."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from minirospy.core.idl.message_text import strify_message
from minirospy.core.idl.protocols import Message, is_stamped
from minirospy.introspect.echo import elided
from minirospy.introspect.plot import plot_header, plot_row

if TYPE_CHECKING:
    from minirospy.base.times import Time

__all__ = ["CallbackEcho", "create_field_filter", "create_value_transform"]

_CLEAR_SCREEN = "\033[2J\033[;H"
FieldFilter = Callable[[Message], Sequence[str]]
ValueTransform = Callable[[object, object], object]


class CallbackEcho:
    """Prints messages like `rostopic echo`. Usage: ``rospy.Subscriber(topic, Type, echo.callback, {"topic": topic})``.

    ``msg_eval`` extracts the field to print; messages for which ``filter_fn`` returns a falsy value are not printed.
    ``done`` becomes True after ``count`` messages.
    """

    def __init__(
        self,
        topic: str,
        msg_eval: Callable[[Message], object] | None,
        plot: bool = False,
        filter_fn: Callable[[Message], bool] | None = None,
        echo_clear: bool = False,
        echo_all_topics: bool = False,
        offset_time: bool = False,
        count: int | None = None,
        field_filter_fn: FieldFilter | None = None,
        fixed_numeric_width: int | None = None,
        value_transform_fn: ValueTransform | None = None,
    ) -> None:
        if topic.endswith("/"):
            topic = topic[:-1]

        self.topic = topic
        self.msg_eval = msg_eval
        self.plot = plot
        self.filter_fn = filter_fn
        self.prefix = _CLEAR_SCREEN if echo_clear and not plot else ""
        self.echo_all_topics = echo_all_topics
        self.offset_time = offset_time
        self.max_count = count
        self.field_filter = field_filter_fn
        self.fixed_numeric_width = fixed_numeric_width
        self.value_transform = value_transform_fn

        self.count = 0
        self.done = False
        self.first = True

    def callback(
        self, data: Message, callback_args: Mapping[str, object], current_time: Time | None = None
    ) -> None:
        """Print a message. ``callback_args`` holds its ``topic`` and, if known, its ``type_information``."""
        if self.done or not self._wanted(data, str(callback_args["topic"])):
            return
        value = self.msg_eval(data) if self.msg_eval is not None else data
        if value is not None:
            print(
                self.prefix + self._text(value, callback_args.get("type_information"), current_time),
                flush=True,
            )
        self.count += 1
        if self.max_count is not None and self.count >= self.max_count:
            self.done = True

    def _wanted(self, message: Message, topic: str) -> bool:
        mine = self.echo_all_topics or topic == self.topic or self.topic.startswith(topic + "/")
        return mine and (self.filter_fn is None or bool(self.filter_fn(message)))

    def _text(self, value: object, type_: object, current_time: Time | None) -> str:
        from minirospy.client import Time

        if self.plot:
            return self._row(value, current_time or Time.now())
        if self.value_transform is not None:
            value = self.value_transform(value, type_)
        if isinstance(value, bytes):
            value = list(value)
        offset = (current_time or Time.now()) if self.offset_time else None
        text = strify_message(
            value,
            time_offset=offset,
            current_time=current_time,
            field_filter=self.field_filter,
            fixed_numeric_width=self.fixed_numeric_width,
        )
        return f"{text}\n---"

    def _row(self, value: object, now: Time) -> str:
        header = plot_header(value) + "\n" if self.first else ""
        self.first = False
        stamp = value.header.stamp if is_stamped(value) else now
        origin = now.to_nsec() if self.offset_time else 0
        return header + plot_row(value, stamp.to_nsec() - origin, origin=origin)


def create_field_filter(echo_nostr: bool, echo_noarr: bool) -> FieldFilter:
    """Return a function for `strify_message` that omits string fields or array fields."""

    def fields(message: Message) -> list[str]:
        return [
            name
            for name, type_ in zip(message.__slots__, message._slot_types, strict=True)
            if not (echo_nostr and "string" in type_) and not (echo_noarr and "[" in type_)
        ]

    return fields


def create_value_transform(echo_nostr: bool, echo_noarr: bool) -> ValueTransform:
    """Return a function that receives (value, type) and replaces strings or arrays with a placeholder."""
    return lambda value, type_: elided(value, str(type_ or ""), not echo_nostr, not echo_noarr)
