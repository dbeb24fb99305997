"""Read worlds and models from text: SDF 1.4 to 1.7, and robot descriptions (URDF) with ``<gazebo>`` tags.

A function passed by the caller resolves URIs. Unusable parts are skipped, with one line each in ``warnings``.
"""

from __future__ import annotations

import os
from dataclasses import replace

from minirospy.base.errors import SdfError
from minirospy.core.sdf.includes import open_include, sdf_version
from minirospy.core.sdf.model import Model, World
from minirospy.core.sdf.read_model import read_included_model, read_model
from minirospy.core.sdf.read_world import read_world
from minirospy.core.sdf.source import MAX_PARTS, Resolve, Shared, Source, no_files
from minirospy.core.sdf.text import Element, parse_document
from minirospy.core.sdf.urdf import read_urdf

__all__ = ["Resolve", "new_source", "no_files", "parse_model", "parse_urdf", "parse_world"]

_OLDEST = (1, 4)


def parse_urdf(
    text: str | bytes, resolve: Resolve = no_files, *, file: str = "robot_description", name: str = ""
) -> Model:
    """Return the model of a robot description; ``name`` replaces the robot's name. Raise SdfError if it is unusable."""
    source = new_source(file, resolve)
    return read_urdf(parse_document(text, file, source.warnings), source, name)


def parse_model(
    text: str | bytes, resolve: Resolve = no_files, *, file: str = "model", name: str = ""
) -> Model:
    """Return the first model in SDF or URDF text; ``name`` replaces the model's name. Raise SdfError if none is usable."""
    source = new_source(file, resolve)
    root = parse_document(text, file, source.warnings)
    if root.tag == "robot":
        return read_urdf(root, source, name)
    if root.tag not in ("sdf", "gazebo", "model"):
        raise source.error(root, f"the root is <{root.tag}>: <sdf> or <robot> is expected")
    source = _versioned(source, root)
    if root.tag == "model":
        return read_model(root, source, name)
    for element in _entities(root):
        if element.tag == "model":
            return read_model(element, source, name)
        included = open_include(element, source)
        if included is not None and included.entity.tag == "model":
            return read_included_model(replace(included, name=name or included.name), source)
    raise SdfError(file, root.line, "there is no <model>")


def parse_world(
    text: str | bytes, resolve: Resolve = no_files, *, file: str = "world", max_parts: int = MAX_PARTS
) -> World:
    """Return the first world in SDF text. If there is none, return a world with the text's models and lights.

    Models that are unusable, or exceed ``max_parts`` links, joints and models, are skipped, and named in ``warnings``. Raise
    SdfError if the text is not SDF.
    """
    source = new_source(file, resolve, max_parts)
    root = parse_document(text, file, source.warnings)
    if root.tag not in ("sdf", "gazebo", "world"):
        raise source.error(root, f"the root is <{root.tag}>: <sdf> is expected")
    world = root if root.tag == "world" else root.first("world")
    return read_world(world or root, _versioned(source, root))


def new_source(file: str, resolve: Resolve, max_parts: int = MAX_PARTS) -> Source:
    """Return the source of a document. If ``file`` is a path, relative URIs are resolved below its folder."""
    is_file = os.path.isabs(file) and os.path.isfile(file)
    path = os.path.realpath(file) if is_file else ""
    return Source(
        file, resolve, [], Shared(max_parts=max_parts), os.path.dirname(path), chain=(path,) if path else ()
    )


def _versioned(source: Source, root: Element) -> Source:
    version = sdf_version(root)
    if version < _OLDEST:
        source.warn(root, f"SDF {version[0]}.{version[1]} is older than 1.4: parts of it may be missing")
    return replace(source, version=version)


def _entities(root: Element) -> list[Element]:
    found = [child for child in root.children if child.tag in ("model", "include")]
    for world in root.all("world"):
        found += [child for child in world.children if child.tag in ("model", "include")]
    return found
