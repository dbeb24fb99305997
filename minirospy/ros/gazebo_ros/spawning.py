"""Create models from the URDF or SDF text in a request, with the request's name and namespace."""

from __future__ import annotations

import re
from dataclasses import replace

from minirospy.base.errors import NotFoundError, SdfError
from minirospy.core.sdf.model import Model, Plugin
from minirospy.core.sdf.read import parse_model, parse_urdf
from minirospy.core.sdf.text import Element, new_element, parse_document
from minirospy.ros.gazebo_ros.paths import ResourcePaths

__all__ = ["UnknownPackage", "WrongFormat", "read_sdf_request", "read_urdf_request", "with_namespace"]

_PACKAGE = re.compile(r"package://([^/\"'<]+)/")


class WrongFormat(Exception):
    """Raised if the text is not in the format that the service expects."""


class UnknownPackage(Exception):
    """Raised if the text refers to a package that does not exist; ``str()`` is the package's name."""


def read_urdf_request(text: str, name: str, namespace: str, resources: ResourcePaths) -> Model:
    """Return the model in a URDF text. Raise WrongFormat if it has no ``<robot>``, else UnknownPackage or SdfError."""
    if _root(text).tag != "robot":
        raise WrongFormat
    for package in dict.fromkeys(_PACKAGE.findall(text)):
        try:
            if resources.find_package is not None:
                resources.find_package(package)
        except NotFoundError:
            raise UnknownPackage(package) from None
    return with_namespace(parse_urdf(text, resources.resolve, name=name), namespace)


def read_sdf_request(text: str, name: str, namespace: str, resources: ResourcePaths) -> Model:
    """Return the model in an SDF or URDF text. Raise WrongFormat if it is neither, SdfError if it is unusable."""
    if _root(text).tag not in ("sdf", "gazebo", "robot"):
        raise WrongFormat
    return with_namespace(parse_model(text, resources.resolve, file=name, name=name), namespace)


def _root(text: str) -> Element:
    try:
        return parse_document(text, "model_xml")
    except SdfError as error:
        raise WrongFormat(str(error)) from error


def with_namespace(model: Model, namespace: str) -> Model:
    """Return the model with ``<robotNamespace>`` added to each plugin without one, as Gazebo's services do."""
    if not namespace:
        return model
    links = {}
    for name, link in model.links.items():
        sensors = tuple(
            replace(sensor, plugins=tuple(_named(each, namespace) for each in sensor.plugins))
            for sensor in link.sensors
        )
        links[name] = replace(link, sensors=sensors)
    return replace(model, links=links, plugins=tuple(_named(each, namespace) for each in model.plugins))


def _named(plugin: Plugin, namespace: str) -> Plugin:
    if plugin.element.first("robotNamespace") is not None:
        return plugin
    element = replace(
        plugin.element, children=[*plugin.element.children, new_element("robotNamespace", namespace)]
    )
    return replace(plugin, element=element)
