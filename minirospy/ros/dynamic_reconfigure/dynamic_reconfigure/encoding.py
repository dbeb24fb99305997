"""dynamic_reconfigure.encoding: converts configurations and descriptions to messages, and back.

A configuration is a dict of values keyed by name. Its key ``groups`` contains the tree of its groups, each a dict with
``id``, ``parent``, ``name``, ``type``, ``state``, ``groups`` and ``parameters``. Groups refer to each other by ID; 0 is
the root group.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, TypeVar

from dynamic_reconfigure.msg import (
    BoolParameter,
    ConfigDescription,
    DoubleParameter,
    Group,
    GroupState,
    IntParameter,
    ParamDescription,
    StrParameter,
)
from dynamic_reconfigure.msg import Config as ConfigMsg

from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure import ConfigType, Entry, GroupTree, Values

if TYPE_CHECKING:
    from dynamic_reconfigure.msg import ConfigDescription as ConfigDescrMsg
    from dynamic_reconfigure.msg import Group as GroupMsg

__all__ = [
    "BoolParameter",
    "Config",
    "ConfigDescrMsg",
    "ConfigMsg",
    "DoubleParameter",
    "GroupMsg",
    "GroupState",
    "IntParameter",
    "ParamDescription",
    "StrParameter",
    "decode_config",
    "decode_description",
    "encode_config",
    "encode_description",
    "encode_groups",
    "extract_params",
    "get_parents",
    "get_tree",
    "group_dict",
    "initial_config",
]

_G = TypeVar("_G", bound="Group | GroupState")


class Config(dict[str, Any]):
    """A configuration whose values are also attributes. Reading a missing attribute raises KeyError, as in ROS."""

    def __init__(self, *args: Iterable[tuple[str, object]] | Values, **kwargs: object) -> None:
        """Create a configuration. The arguments are those of ``dict()``."""
        super().__init__(*args, **kwargs)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            # copy and pickle look up special methods and expect AttributeError.
            raise AttributeError(name)
        return self[name]

    def __setattr__(self, name: str, value: object) -> None:
        self[name] = value

    def copy(self) -> Config:
        """Return a copy with the same values."""
        return Config(self)

    def __deepcopy__(self, memo: dict[int, object]) -> Config:
        return type(self)({key: copy.deepcopy(value, memo) for key, value in self.items()})

    def __reduce__(self) -> tuple[type[Config], tuple[dict[str, object]]]:
        return type(self), (dict(self),)


def encode_description(descr: ConfigType) -> ConfigDescription:
    """Return the message that describes a configuration type."""
    return ConfigDescription(
        groups=encode_groups(None, descr.config_description),
        max=encode_config(descr.max),
        min=encode_config(descr.min),
        dflt=encode_config(descr.defaults),
    )


def encode_groups(parent: Group | None, group: GroupTree) -> list[Group]:
    """Convert a group in a type's description, and all its subgroups, to messages."""
    parameters = [
        ParamDescription(*(each[key] for key in ("name", "type", "level", "description", "edit_method")))
        for each in group["parameters"]
    ]
    encoded = Group(group["name"], group["type"], parameters, group["parent"], group["id"])
    return [encoded, *(inner for each in group["groups"] for inner in encode_groups(encoded, each))]


def encode_config(config: Values, flat: bool = True) -> ConfigMsg:
    """Convert a configuration to a message. Omit values that are not bool, int, float, str or groups.

    If ``flat``, the key ``groups`` contains a tree, and all groups in the tree are added; otherwise, it contains a dict of the
    groups.
    """
    message = ConfigMsg()
    lists: dict[type, tuple[list[Any], type[Any]]] = {
        int: (message.ints, IntParameter),
        bool: (message.bools, BoolParameter),
        str: (message.strs, StrParameter),
        float: (message.doubles, DoubleParameter),
    }
    for name, value in config.items():
        if type(value) in lists:
            values, parameter = lists[type(value)]
            values.append(parameter(name, value))
        elif isinstance(value, dict):
            groups = [value, *_inner_groups(value)] if flat else value.values()
            message.groups += [
                GroupState(each["name"], each["state"], each["id"], each["parent"]) for each in groups
            ]
    return message


def _inner_groups(group: GroupTree) -> Iterator[GroupTree]:
    """Yield all nested subgroups of a group, each after its own subgroups."""
    for each in group["groups"].values():
        yield from _inner_groups(each)
        yield each


def group_dict(group: Group | GroupState) -> Config:
    """Return a group's own data, without its subgroups and parameters. The state is True for a group in a description."""
    return Config(
        id=group.id,
        parent=group.parent,
        name=group.name,
        type=getattr(group, "type", ""),
        state=getattr(group, "state", True),
        groups=Config(),
        parameters=Config(),
    )


def decode_description(msg: ConfigDescription) -> Config:
    """Return a type's groups as a tree, with a dict of ``name``, ``min``, ``max``, ``default``, ... for each parameter."""
    least, greatest, defaults = (decode_config(each) for each in (msg.min, msg.max, msg.dflt))

    def described(group: Group) -> Config:
        decoded = group_dict(group)
        decoded["parameters"] = [
            {
                "name": each.name,
                "min": least[each.name],
                "max": greatest[each.name],
                "default": defaults[each.name],
                "type": each.type,
                "level": each.level,
                "description": each.description,
                "edit_method": each.edit_method,
            }
            for each in group.parameters
        ]
        return decoded

    return _tree(msg.groups, described)


def get_tree(m: ConfigDescription | ConfigMsg, group: Group | GroupState | None = None) -> Config:
    """Return a message's groups as a tree. For a ``group`` other than the root, return only a dict of its subgroups."""
    if group is None or group.id == 0:
        return _tree(m.groups, group_dict)
    return _children(m.groups, group.id, group_dict, set())


def _tree(groups: Iterable[_G], decode: Callable[[_G], Config]) -> Config:
    """Return the root group with its subgroups, or an empty group if the message has none."""
    outermost = [each for each in groups if each.id == 0]
    if not outermost:
        return Config(groups=Config(), parameters=[])
    root: Config = decode(outermost[-1])
    root["groups"] = _children(groups, 0, decode, set())
    return root


def _children(groups: Iterable[_G], parent: int, decode: Callable[[_G], Config], above: set[int]) -> Config:
    """Return a dict of a group's subgroups, keyed by name. Omit groups that contain themselves."""
    children = Config()
    for each in groups:
        if each.id != 0 and each.parent == parent and each.id not in above:
            decoded = decode(each)
            decoded["groups"] = _children(groups, each.id, decode, above | {each.id})
            children[decoded["name"]] = decoded
    return children


def initial_config(msg: ConfigMsg, description: GroupTree | None = None) -> Config:
    """Return a server's initial configuration, with the groups' states from the type's description."""
    config = _values(msg)
    if msg.groups and description is not None:
        config["groups"] = get_tree(msg)
        states = {each["id"]: each["state"] for each in _all_groups(description)}
        for group in _inner_groups(config["groups"]):
            group["state"] = states.get(group["id"], group["state"])  # type: ignore[index]
        for group, described in _matching(config["groups"], description):
            group["parameters"].update(
                {each["name"]: config[each["name"]] for each in described["parameters"]}
            )
    return config


def decode_config(msg: ConfigMsg, description: GroupTree | None = None) -> Config:
    """Decode a configuration. If ``description`` is given, also copy each parameter's value to the group that contains it."""
    config = _values(msg)
    if msg.groups and description is not None:
        config["groups"] = get_tree(msg)
        for group, described in _matching(config["groups"], description):
            names = [each["name"] for each in described["parameters"]]
            group.update({name: config[name] for name in names if name in config})
    return config


def _values(msg: ConfigMsg) -> Config:
    parameters: list[BoolParameter | IntParameter | StrParameter | DoubleParameter] = [
        *msg.bools,
        *msg.ints,
        *msg.strs,
        *msg.doubles,
    ]
    return Config((each.name, each.value) for each in parameters)


def _groups_in(group: GroupTree) -> list[GroupTree]:
    """Return a group's subgroups: a list in a type's description, a dict in a decoded one."""
    groups = group["groups"]
    return list(groups.values()) if isinstance(groups, dict) else list(groups)


def _all_groups(group: GroupTree) -> Iterator[GroupTree]:
    yield group
    for each in _groups_in(group):
        yield from _all_groups(each)


def _matching(group: Config, description: GroupTree) -> Iterator[tuple[Config, GroupTree]]:
    """Yield pairs: a group in a configuration, and the group of the same name in the description."""
    yield group, description
    described = {each["name"]: each for each in _groups_in(description)}
    for name, each in group["groups"].items():
        if name in described:
            yield from _matching(each, described[name])


def extract_params(group: GroupTree) -> list[Entry]:
    """Return the parameters in a group and in all its subgroups."""
    return [each for inner in _all_groups(group) for each in inner["parameters"]]


def get_parents(group: GroupTree, descriptions: GroupTree) -> list[GroupTree]:
    """Return a group's ancestors, outermost first; ``descriptions["group"]`` lists all groups."""
    for each in descriptions["group"]:
        if each["id"] == group["parent"] and each is not group:
            return [*get_parents(each, descriptions), each]
    return []
