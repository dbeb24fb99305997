"""Opens bags older than version 2.0. Only this module knows their readers, and imports them when such a bag is opened."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import BinaryIO

from minirospy.base.errors import BagVersionError
from minirospy.core.bag import records
from minirospy.core.bag.base import BagReader, ScannedReader

__all__ = ["open_old_bag", "unindexed_old_bag"]

_READERS = {1: "minirospy.core.bag.reader12"}
"""Dict from major version to a module with ``open_bag12`` and ``unindexed_bag12``."""


def open_old_bag(stream: BinaryIO, version: int) -> BagReader:
    """Return a reader for the bag whose first line has been read.

    Raise BagVersionError if the version is not supported, BagUnindexedError if the bag's index is missing or damaged.
    """
    reader: BagReader = _module(version).open_bag12(stream, version)
    return reader


def unindexed_old_bag(stream: BinaryIO) -> ScannedReader:
    """Return a reader that can scan the unindexed bag at the stream's position.

    Raise BagFormatError if it is not a bag, BagVersionError if its version is not supported.
    """
    start = stream.tell()
    version = records.read_version(stream)
    stream.seek(start)
    reader: ScannedReader = _module(version).unindexed_bag12(stream)
    return reader


def _module(version: int) -> ModuleType:
    name = _READERS.get(version // 100, "")
    try:
        if name:
            return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
    raise BagVersionError(version, f"unknown bag version {version}")
