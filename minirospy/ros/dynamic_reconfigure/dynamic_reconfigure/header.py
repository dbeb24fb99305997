"""The C++ header generated from a .cfg file: PACKAGE::NAMEConfig, for dynamic_reconfigure::Server and Client. Pure.

The code is minirospy's own; the names are those that C++ programs and ROS's server.h and client.h use: the fields,
``groups``, the constants, and the functions ``__fromMessage__``, ``__clamp__``, ``__level__`` and so on.
Source: http://wiki.ros.org/dynamic_reconfigure/Tutorials/SettingUpDynamicReconfigureForANode(cpp).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure import Entry, Value

__all__ = ["cpp_header"]

_HEADER = """\
// Made by dynamic_reconfigure (minirospy) for the package {package}: do not edit.
#ifndef {guard}
#define {guard}

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <boost/any.hpp>
#include <boost/shared_ptr.hpp>
#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Group.h>
#include <dynamic_reconfigure/ParamDescription.h>
#include <dynamic_reconfigure/config_tools.h>
#include <ros/console.h>
#include <ros/node_handle.h>

namespace {package}
{{
class {config}
{{
public:
{fields}
{groups}

  // One parameter, whatever its type is.
  class AbstractParamDescription : public dynamic_reconfigure::ParamDescription
  {{
  public:
    virtual ~AbstractParamDescription() = default;
    virtual void clamp({config} &config, const {config} &max, const {config} &min) const = 0;
    virtual void calcLevel(uint32_t &level, const {config} &one, const {config} &other) const = 0;
    virtual void fromServer(const ros::NodeHandle &node, {config} &config) const = 0;
    virtual void toServer(const ros::NodeHandle &node, const {config} &config) const = 0;
    virtual bool fromMessage(const dynamic_reconfigure::Config &message, {config} &config) const = 0;
    virtual void toMessage(dynamic_reconfigure::Config &message, const {config} &config) const = 0;
    virtual void getValue(const {config} &config, boost::any &value) const = 0;
  }};
  typedef boost::shared_ptr<AbstractParamDescription> AbstractParamDescriptionPtr;
  typedef boost::shared_ptr<const AbstractParamDescription> AbstractParamDescriptionConstPtr;

  template <class T>
  class ParamDescription final : public AbstractParamDescription
  {{
  public:
    ParamDescription(const char *name, const char *type, uint32_t level, const char *description,
                     const char *edit_method, T {config}::*member)
      : field(member)
    {{
      this->name = name;
      this->type = type;
      this->level = level;
      this->description = description;
      this->edit_method = edit_method;
    }}

    T {config}::*field;

    void clamp({config} &config, const {config} &max, const {config} &min) const override
    {{
      limit(config.*field, max.*field, min.*field);
    }}
    void calcLevel(uint32_t &bits, const {config} &one, const {config} &other) const override
    {{
      bits |= one.*field != other.*field ? level : 0;
    }}
    void fromServer(const ros::NodeHandle &node, {config} &config) const override
    {{
      node.getParam(name, config.*field);
    }}
    void toServer(const ros::NodeHandle &node, const {config} &config) const override
    {{
      node.setParam(name, config.*field);
    }}
    bool fromMessage(const dynamic_reconfigure::Config &message, {config} &config) const override
    {{
      return dynamic_reconfigure::ConfigTools::getParameter(message, name, config.*field);
    }}
    void toMessage(dynamic_reconfigure::Config &message, const {config} &config) const override
    {{
      dynamic_reconfigure::ConfigTools::appendParameter(message, name, config.*field);
    }}
    void getValue(const {config} &config, boost::any &value) const override
    {{
      value = config.*field;
    }}

  private:
    // Texts have no limits.
    static void limit(std::string &, const std::string &, const std::string &) {{}}
    template <class V>
    static void limit(V &value, const V &max, const V &min)
    {{
      value = value > max ? max : value < min ? min : value;
    }}
  }};

  // One group, with the parameters that are shown in it.
  class AbstractGroupDescription : public dynamic_reconfigure::Group
  {{
  public:
    AbstractGroupDescription(const char *name, const char *type, int parent, int id, bool is_open) : state(is_open)
    {{
      this->name = name;
      this->type = type;
      this->parent = parent;
      this->id = id;
    }}

    std::vector<AbstractParamDescriptionConstPtr> abstract_parameters;
    bool state;
  }};
  typedef boost::shared_ptr<AbstractGroupDescription> AbstractGroupDescriptionPtr;
  typedef boost::shared_ptr<const AbstractGroupDescription> AbstractGroupDescriptionConstPtr;

  // Returns whether the message has a known name for each of its values; takes what it knows.
  bool __fromMessage__(dynamic_reconfigure::Config &message)
  {{
    int known = 0;
    for (const auto &each : __getParamDescriptions__())
      known += each->fromMessage(message, *this);
    groups.setParams(*this);
    groupStates(message);

    if (known == dynamic_reconfigure::ConfigTools::size(message))
      return true;
    ROS_ERROR("{config}::__fromMessage__ called with an unexpected parameter: %d of %d are known.", known,
              dynamic_reconfigure::ConfigTools::size(message));
    return false;
  }}

  void __toMessage__(dynamic_reconfigure::Config &message,
                     const std::vector<AbstractParamDescriptionConstPtr> &parameters,
                     const std::vector<AbstractGroupDescriptionConstPtr> &) const
  {{
    using dynamic_reconfigure::ConfigTools;
    ConfigTools::clear(message);
    for (const auto &each : parameters)
      each->toMessage(message, *this);
{append_groups}
  }}

  void __toMessage__(dynamic_reconfigure::Config &message) const
  {{
    __toMessage__(message, __getParamDescriptions__(), __getGroupDescriptions__());
  }}

  void __toServer__(const ros::NodeHandle &node) const
  {{
    for (const auto &each : __getParamDescriptions__())
      each->toServer(node, *this);
  }}

  void __fromServer__(const ros::NodeHandle &node)
  {{
    for (const auto &each : __getParamDescriptions__())
      each->fromServer(node, *this);
{initial_states}
  }}

  void __clamp__()
  {{
    for (const auto &each : __getParamDescriptions__())
      each->clamp(*this, __getMax__(), __getMin__());
  }}

  uint32_t __level__(const {config} &config) const
  {{
    uint32_t level = 0;
    for (const auto &each : __getParamDescriptions__())
      each->calcLevel(level, config, *this);
    return level;
  }}

  static const dynamic_reconfigure::ConfigDescription &__getDescriptionMessage__();
  static const {config} &__getDefault__();
  static const {config} &__getMax__();
  static const {config} &__getMin__();
  static const std::vector<AbstractParamDescriptionConstPtr> &__getParamDescriptions__();
  static const std::vector<AbstractGroupDescriptionConstPtr> &__getGroupDescriptions__();

private:
  bool groupStates(const dynamic_reconfigure::Config &message)
  {{
    using dynamic_reconfigure::ConfigTools;
{read_groups}
  }}
}};

class {config}Statics
{{
public:
  {config} __max__, __min__, __default__;
  std::vector<{config}::AbstractParamDescriptionConstPtr> __param_descriptions__;
  std::vector<{config}::AbstractGroupDescriptionConstPtr> __group_descriptions__;
  dynamic_reconfigure::ConfigDescription __description_message__;

  static const {config}Statics &instance()
  {{
    static const {config}Statics statics;
    return statics;
  }}

private:
  template <class T>
  void parameter(const boost::shared_ptr<{config}::AbstractGroupDescription> &group, const char *name,
                 const char *type, uint32_t level, const char *description, const char *edit_method,
                 T {config}::*member, const T &min, const T &max, const T &value)
  {{
    __min__.*member = min;
    __max__.*member = max;
    __default__.*member = value;
    {config}::AbstractParamDescriptionConstPtr made(
        new {config}::ParamDescription<T>(name, type, level, description, edit_method, member));
    __param_descriptions__.push_back(made);
    group->abstract_parameters.push_back(made);
    group->parameters.push_back(*made);
  }}

  {config}Statics()
  {{
    typedef {config}::AbstractGroupDescription Group;
    typedef boost::shared_ptr<Group> GroupPtr;
{statics}

    for (const auto &each : __group_descriptions__)
      __description_message__.groups.push_back(*each);
    __max__.__toMessage__(__description_message__.max, __param_descriptions__, __group_descriptions__);
    __min__.__toMessage__(__description_message__.min, __param_descriptions__, __group_descriptions__);
    __default__.__toMessage__(__description_message__.dflt, __param_descriptions__, __group_descriptions__);
  }}
}};

inline const dynamic_reconfigure::ConfigDescription &{config}::__getDescriptionMessage__()
{{
  return {config}Statics::instance().__description_message__;
}}
inline const {config} &{config}::__getDefault__()
{{
  return {config}Statics::instance().__default__;
}}
inline const {config} &{config}::__getMax__()
{{
  return {config}Statics::instance().__max__;
}}
inline const {config} &{config}::__getMin__()
{{
  return {config}Statics::instance().__min__;
}}
inline const std::vector<{config}::AbstractParamDescriptionConstPtr> &{config}::__getParamDescriptions__()
{{
  return {config}Statics::instance().__param_descriptions__;
}}
inline const std::vector<{config}::AbstractGroupDescriptionConstPtr> &{config}::__getGroupDescriptions__()
{{
  return {config}Statics::instance().__group_descriptions__;
}}
{constants}
}}  // namespace {package}

#endif  // {guard}
"""


class Group(Protocol):
    """A group of a .cfg file, with its subgroups."""

    name: str
    type: str
    state: bool
    id: int
    parent: int
    parameters: list[Entry]

    @property
    def groups(self) -> Sequence[Group]:
        """Return the subgroups."""

    def get_class(self, parent: bool = False) -> str:
        """Return the C++ name of its class."""


def cpp_header(package: str, name: str, group: Group, constants: Iterable[Entry]) -> str:
    """Return the text of PACKAGE/NAMEConfig.h; ``group`` is the root group."""
    config = f"{name}Config"
    groups = list(_in_order(group, "groups"))
    reads = [
        f'    if (!ConfigTools::getGroupState(message, "{each.name}", {path})) return false;'
        for each, path in groups
    ]
    return _HEADER.format(
        package=package,
        config=config,
        guard=f"__{package}__{name.upper()}CONFIG_H__",
        fields="\n".join(f"  {param['ctype']} {param['name']}{{}};" for param, _ in _parameters(group)),
        groups=_group_class(group, config, "groups", "  "),
        append_groups="\n".join(
            f'    ConfigTools::appendGroup(message, "{each.name}", {each.id}, {each.parent}, {path});'
            for each, path in groups
        ),
        initial_states="\n".join(f"    {path}.state = {_literal(each.state)};" for each, path in groups),
        read_groups="\n".join([*reads, "    return true;"]),
        statics="\n".join(_statics(group, config)),
        constants="".join(
            f"\n{constant['cconsttype']} {name}_{constant['name']} = {_literal(constant['value'])};"
            for constant in constants
        ),
    )


def _in_order(group: Group, path: str) -> Iterator[tuple[Group, str]]:
    """Yield each group before its subgroups, with the C++ expression of its member variable."""
    yield group, path
    for each in group.groups:
        yield from _in_order(each, f"{path}.{each.name.lower()}")


def _parameters(group: Group) -> Iterator[tuple[Entry, Group]]:
    for each, _ in _in_order(group, ""):
        yield from ((param, each) for param in each.parameters)


def _group_class(group: Group, config: str, member: str, indent: str) -> str:
    """Return the C++ class of a group, followed by the member variable of that class."""
    copies = [f"{param['name']} = config.{param['name']};" for param in group.parameters]
    copies += [f"{each.name.lower()}.setParams(config);" for each in group.groups]
    lines = [
        f"class {group.name.upper()}",
        "{",
        "public:",
        "  bool state = true;",
        f'  std::string name = "{group.name}";',
        *(f"  {param['ctype']} {param['name']}{{}};" for param in group.parameters),
        *(_group_class(each, config, each.name.lower(), "  ") for each in group.groups),
        "",
        f"  void setParams(const {config} &config)",
        "  {",
        *(f"    {copy}" for copy in copies),
        *(["    (void)config;"] if not copies else []),
        "  }",
        f"}} {member};",
    ]
    return "\n".join(f"{indent}{line}" if line else "" for part in lines for line in part.split("\n"))


def _statics(group: Group, config: str) -> Iterator[str]:
    """Yield the statements that describe a group; a group is added after its subgroups."""
    yield (
        f'    GroupPtr group_{group.id}(new Group("{group.name}", {_literal(group.type)}, {group.parent}, '
        f"{group.id}, {_literal(group.state)}));"
    )
    for param in group.parameters:
        words = (_literal(param[key]) for key in ("name", "type"))
        texts = (_literal(param[key]) for key in ("description", "edit_method"))
        limits = (_literal(value) for key in ("min", "max", "default") if (value := param[key]) is not None)
        yield (
            f"    parameter<{param['ctype']}>(group_{group.id}, {', '.join(words)}, {param['level']}u, "
            f"{', '.join(texts)}, &{config}::{param['name']}, {', '.join(limits)});"
        )
    for each in group.groups:
        yield from _statics(each, config)
    yield f"    __group_descriptions__.push_back(group_{group.id});"


def _literal(value: Value) -> str:
    """Return a value as a C++ literal."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return "(-2147483647 - 1)" if value == -0x80000000 else str(value)
    if isinstance(value, float):
        if math.isfinite(value):
            return repr(value)
        limits = "std::numeric_limits<double>::"
        return (
            limits + "quiet_NaN()"
            if math.isnan(value)
            else ("-" if value < 0 else "") + limits + "infinity()"
        )
    # Non-ASCII bytes become octal escapes, which end after at most three digits.
    return '"' + "".join(_character(byte) for byte in value.encode()) + '"'


def _character(byte: int) -> str:
    character = chr(byte)
    if character in '"\\?':
        return f"\\{character}"
    return character if 32 <= byte < 127 else f"\\{byte:03o}"
