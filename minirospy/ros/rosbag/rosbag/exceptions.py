"""rosbag's exceptions, and the conversion of minirospy's bag errors to them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

from minirospy.base.errors import BagEncryptedError, BagError, BagFormatError, BagUnindexedError, NoBagError

__all__ = [
    "ROSBagEncryptException",
    "ROSBagEncryptNotSupportedException",
    "ROSBagException",
    "ROSBagFormatException",
    "ROSBagUnindexedException",
    "as_ros_errors",
    "raise_as_ros",
]


class ROSBagException(Exception):
    """Base class of rosbag's errors; ``value`` is the message."""

    def __init__(self, value: str | None = None) -> None:
        super().__init__(value)
        self.value = value

    def __str__(self) -> str:
        return self.value or ""


class ROSBagFormatException(ROSBagException):
    """Raised if a bag's bytes violate the format."""

    def __init__(self, value: str) -> None:
        super().__init__(value)


class ROSBagUnindexedException(ROSBagException):
    """Raised if a bag was not closed or its index is damaged."""

    def __init__(self, *args: object) -> None:
        super().__init__("Unindexed bag")


class ROSBagEncryptNotSupportedException(ROSBagException):
    """Raised if a bag is encrypted or encryption was requested; neither is supported."""

    def __init__(self, value: str) -> None:
        super().__init__(value)


class ROSBagEncryptException(ROSBagException):
    """Raised if encryption failed."""

    def __init__(self, value: str) -> None:
        super().__init__(value)


@contextmanager
def as_ros_errors() -> Iterator[None]:
    """Convert minirospy's bag errors to rosbag's exceptions, which programs catch."""
    try:
        yield
    except BagError as error:
        raise_as_ros(error)


def raise_as_ros(error: BagError) -> NoReturn:
    """Raise the rosbag exception that corresponds to a minirospy error."""
    if isinstance(error, BagUnindexedError):
        raise ROSBagUnindexedException from error
    if isinstance(error, BagEncryptedError):
        raise ROSBagEncryptNotSupportedException(str(error)) from error
    is_damage = isinstance(error, BagFormatError) and not isinstance(error, NoBagError)
    kind = ROSBagFormatException if is_damage else ROSBagException
    raise kind(str(error)) from error
