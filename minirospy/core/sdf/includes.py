"""Find and open the files that ``<include>`` refers to: a model folder with ``model.config``, or an SDF file."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace

from minirospy.base.errors import SdfError
from minirospy.core.sdf.source import Source
from minirospy.core.sdf.text import Element, parse_document

__all__ = ["Included", "open_include", "sdf_version"]

_ENTITIES = ("model", "light", "actor")
_CONFIGS = ("model.config", "manifest.xml")
_NEWEST = (1, 11)  # the newest SDF version that the readers support
_MAX_CONFIG_BYTES = 1024 * 1024


@dataclass(frozen=True)
class Included:
    """An included model, light or actor.

    ``name`` and ``is_static`` come from the ``<include>``; empty and None if it does not specify them.
    """

    element: Element
    entity: Element
    source: Source
    name: str
    is_static: bool | None


def open_include(element: Element, source: Source) -> Included | None:
    """Return the included element, or None if the file contains no model, light or actor.

    Raise SdfError if the file does not exist or cannot be read.
    """
    uri = source.text(element, "uri")
    if not uri:
        raise source.error(element, "<include> has no <uri>")
    path = source.find(uri)
    if path is None:
        raise source.error(element, source.missing(uri))
    root, inner = source.open(element, model_file(path))
    inner = replace(inner, version=sdf_version(root))
    entity = (
        root
        if root.tag in _ENTITIES
        else next((each for each in root.children if each.tag in _ENTITIES), None)
    )
    if entity is None:
        return None
    is_static = source.flag(element, "static", False) if element.first("static") is not None else None
    return Included(element, entity, inner, source.text(element, "name"), is_static)


def sdf_version(root: Element) -> tuple[int, int]:
    """Return a document's SDF version; 1.7 if it states none or its root is neither ``<sdf>`` nor ``<gazebo>``."""
    match = re.match(r"\s*(\d+)\.(\d+)", root.attributes.get("version", ""))
    if match is None or root.tag not in ("sdf", "gazebo"):
        return (1, 7)
    return int(match.group(1)), int(match.group(2))


def model_file(path: str) -> str:
    """Return the SDF file in a model's folder, or the path itself if it is a file.

    The newest supported version in ``model.config`` is used. Raise SdfError if the folder contains no model.
    """
    if not os.path.isdir(path):
        return path
    for name in _CONFIGS:
        config = os.path.join(path, name)
        if os.path.isfile(config):
            file = _configured(config, path)
            if file:
                return file
    file = os.path.join(path, "model.sdf")
    if os.path.isfile(file):
        return file
    raise SdfError(path, 0, "the folder has neither model.config nor model.sdf")


def _configured(config: str, folder: str) -> str:
    try:
        if os.path.getsize(config) > _MAX_CONFIG_BYTES:
            raise SdfError(config, 0, "the file is too large")
        with open(config, "rb") as stream:
            root = parse_document(stream.read(), config)
    except OSError as error:
        raise SdfError(config, 0, f"cannot be read: {error.strerror or error}") from None
    best: tuple[tuple[int, int], str] | None = None
    for element in root.all("sdf"):
        match = re.match(r"(\d+)\.(\d+)", element.attributes.get("version", "").strip())
        version = (int(match.group(1)), int(match.group(2))) if match else (1, 0)
        if version <= _NEWEST and (best is None or version > best[0]):
            best = version, element.text.strip()
    if best is None:
        return ""
    return os.path.join(folder, best[1])
