"""Find message and service classes: by the names that clients send, with rosbridge's errors, or by publishers' headers."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import TypeVar

from minirospy.base.errors import BridgeError, MinirospyError
from minirospy.core.idl.load import class_from_text, get_message_class, get_service_class
from minirospy.core.idl.protocols import Message, ServiceClass
from minirospy.core.wire.header import Header

__all__ = ["ArrivingTypes", "UnknownTypeError", "message_class", "service_class"]

_Class = TypeVar("_Class")


class UnknownTypeError(BridgeError):
    """Raised if a type is not installed."""


def message_class(name: str) -> type[Message]:
    """Return the message class named ``name``. Raise UnknownTypeError if it is not installed."""
    return _installed(get_message_class, name, "msg")


def service_class(name: str) -> ServiceClass:
    """Return the service class named ``name``. Raise UnknownTypeError if it is not installed."""
    return _installed(get_service_class, name, "srv")


def _installed(get: Callable[[str], _Class | None], name: str, kind: str) -> _Class:
    try:
        found = get(name)
    except Exception as error:
        # Importing a third-party module may raise any exception: report it as the reason.
        raise _unknown(
            name, kind, f"{type(error).__name__}: {error}" if _is_foreign(error) else str(error)
        ) from error
    if found is None:
        raise _unknown(name, kind, "no such definition is installed here")
    return found


def _is_foreign(error: Exception) -> bool:
    return not isinstance(error, MinirospyError | ImportError | SyntaxError)


def _unknown(name: str, kind: str, why: str) -> UnknownTypeError:
    package, _, short = name.partition("/")
    if not package or not short or "/" in short:
        return UnknownTypeError(f"{name[:200]} is not a valid type string")
    if not _is_installed(package):
        return UnknownTypeError(
            f"Unable to load the manifest for package {package[:200]}. Caused by: {package[:200]}"
        )
    return UnknownTypeError(
        f"Unable to import {kind} class {short[:200]} from package {package[:200]}. Caused by {why}"
    )


def _is_installed(package: str) -> bool:
    try:
        return package.isidentifier() and importlib.util.find_spec(package) is not None
    except (ImportError, ValueError):
        # ValueError: the module has no spec, like __main__.
        return False


class ArrivingTypes:
    """Finds the classes of received messages.

    Uses the installed class if the publisher's md5sum matches; otherwise generates one from the publisher's definition.
    """

    def __init__(self) -> None:
        self._classes: dict[tuple[str, str], type[Message] | None] = {}

    def of(self, header: Header) -> type[Message] | None:
        """Return the class of a publisher's messages, or None if their definition is unknown."""
        key = header.get("type", ""), header.get("md5sum", "")
        if key not in self._classes:
            if len(self._classes) > 1000:
                self._classes.clear()
            self._classes[key] = self._find(*key, header.get("message_definition", ""))
        return self._classes[key]

    def _find(self, name: str, md5sum: str, text: str) -> type[Message] | None:
        try:
            installed = get_message_class(name)
        except Exception:  # noqa: BLE001 - of a module of messages, which may be anybody's
            installed = None
        if installed is not None and installed._md5sum == md5sum:
            return installed
        try:
            made = class_from_text(name, text)
        except MinirospyError:
            return None
        return made if made._md5sum == md5sum else None
