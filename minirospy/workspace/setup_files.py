"""The setup files that users source, such as ``devel/setup.bash``, as strings. Pure.

The files run without Python, so that a new terminal starts quickly. Sourcing a workspace's setup file removes the values
that the previously sourced workspace set, and prepends the values for the parent workspaces and the workspace itself.
Source: http://wiki.ros.org/catkin/workspaces, http://wiki.ros.org/ROS/EnvironmentVariables.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from minirospy.workspace import powershell
from minirospy.workspace.packages import DIST_PACKAGES

__all__ = ["SHELLS", "SetUp", "assignments", "setup_files", "shell_text"]

SHELLS = ("bash", "zsh", "sh", "fish", "powershell", "bat")


class SetUp(NamedTuple):
    """The data that the setup files contain.

    ``prefix``: the devel or install folder; ``sources``: the workspace's package folders; ``parents``: the prefixes of
    the parent workspaces, nearest first; ``programs``: the folder of minirospy's commands; ``share``: minirospy's own
    packages; ``functions``: the folder of ros.bash, ros.fish, ros.ps1, ros.bat.
    """

    prefix: Path
    sources: tuple[Path, ...]
    parents: tuple[Path, ...]
    programs: Path
    share: tuple[Path, ...]
    functions: Path


def setup_files(setup: SetUp) -> dict[str, str]:
    """Return the texts of all setup files for a prefix, keyed by file name."""
    files = {
        ".catkin": ";".join(map(str, setup.sources)),
        "setup.sh": _posix(setup, _others_make_way(setup)),
        # The local_setup files work like `setup.sh --extend`, which keeps the sourced workspaces.
        "local_setup.sh": _posix(setup, ""),
        "env.sh": _ENV,
        "setup.fish": _fish(setup),
        "setup.bat": _bat(setup, _others_make_way_bat(setup)),
        "local_setup.bat": _bat(setup, ""),
        "setup.ps1": _ps1(setup, extends=False),
        "local_setup.ps1": _ps1(setup, extends=True),
        "env.bat": '@echo off\r\ncall "%~dp0setup.bat"\r\n%*\r\n',
    }
    for stem in ("setup", "local_setup"):
        files[f"{stem}.bash"] = _BASH.format(
            file=f"{stem}.sh", functions=_quoted(setup.functions / "ros.bash")
        )
        files[f"{stem}.zsh"] = _ZSH.format(file=f"{stem}.sh", functions=_quoted(setup.functions / "ros.bash"))
    return files


def shell_text(shell: str, setup: SetUp) -> str:
    """Return code for ``eval "$(minirospy shell)"``: the variables without a workspace, and the functions."""
    if shell == "fish":
        return _fish_base(setup) + f"source {_fish_quoted(setup.functions / 'ros.fish')}\n"
    if shell == "powershell":
        base = powershell.powershell_base(_BASE, setup.programs)
        return base + f". {powershell.quoted(setup.functions / 'ros.ps1')}\n"
    if shell == "bat":
        return _bat_base(setup) + f'call "{setup.functions / "ros.bat"}"\n'
    functions = "" if shell == "sh" else f". {_quoted(setup.functions / 'ros.bash')}\n"
    return _posix_base(setup) + functions


def assignments(shell: str, variables: Mapping[str, str]) -> str:
    """Return lines that set and export environment variables in a shell of ``SHELLS``."""
    line = {"fish": _fish_assignment, "powershell": powershell.assignment, "bat": _bat_assignment}.get(
        shell, _posix_assignment
    )
    return "".join(f"{line(name, value)}\n" for name, value in variables.items())


# --- bash, zsh, sh

_HEAD = "# Made by minirospy: `source` it to work with the packages of this workspace.\n"

_BASH = (
    _HEAD
    # Outside a function, `return` succeeds only in a sourced file; $0 would not be reliable.
    + """if ! (return 0 2>/dev/null); then
  echo "a program sets nothing in your terminal; type: source '$0'" >&2
fi
_minirospy_prefix=$(builtin cd "$(dirname "${{BASH_SOURCE[0]}}")" >/dev/null && pwd)
. "$_minirospy_prefix/{file}"
. {functions}
unset _minirospy_prefix
"""
)
_ZSH = (
    _HEAD
    + """_minirospy_prefix=$(builtin cd -q "$(dirname "${{(%):-%x}}")" >/dev/null && pwd)
. "$_minirospy_prefix/{file}"
. {functions}
unset _minirospy_prefix
"""
)
_ENV = """#!/bin/sh
# Runs a command with the environment of this workspace: env.sh COMMAND ...
if [ $# -eq 0 ]; then
  echo "usage: env.sh COMMAND ..." >&2
  exit 1
fi
_minirospy_prefix=$(cd "$(dirname "$0")" >/dev/null && pwd)
. "$_minirospy_prefix/setup.sh"
unset _minirospy_prefix
exec "$@"
"""

_POSIX_FUNCTIONS = """# _minirospy_put VARIABLE ENTRY: put it in front, and take it away where it was before.
_minirospy_put() {
  _minirospy_take "$1" "$2"
  eval "export $1=\\"\\$2\\${$1:+:\\$$1}\\""
}
# _minirospy_take VARIABLE ENTRY: take it out.
_minirospy_take() {
  eval "_minirospy_rest=\\${$1:-}"
  _minirospy_kept=
  while [ -n "$_minirospy_rest" ]; do
    _minirospy_entry=${_minirospy_rest%%:*}
    case $_minirospy_rest in
      *:*) _minirospy_rest=${_minirospy_rest#*:} ;;
      *) _minirospy_rest= ;;
    esac
    if [ -n "$_minirospy_entry" ] && [ "$_minirospy_entry" != "$2" ]; then
      _minirospy_kept="${_minirospy_kept:+$_minirospy_kept:}$_minirospy_entry"
    fi
  done
  if [ -n "$_minirospy_kept" ]; then
    eval "export $1=\\"\\$_minirospy_kept\\""
  else
    unset "$1"
  fi
}
# _minirospy_sources PREFIX put|take: the folders of packages that its file .catkin names.
_minirospy_sources() {
  _minirospy_list=$(cat "$1/.catkin" 2>/dev/null)
  while [ -n "$_minirospy_list" ]; do
    "_minirospy_$2" ROS_PACKAGE_PATH "${_minirospy_list##*;}"
    case $_minirospy_list in
      *\\;*) _minirospy_list=${_minirospy_list%;*} ;;
      *) _minirospy_list= ;;
    esac
  done
}
# _minirospy_workspace PREFIX put|take: all variables of one workspace.
_minirospy_workspace() {
  _minirospy_sources "$1" "$2"
  "_minirospy_$2" CMAKE_PREFIX_PATH "$1"
  "_minirospy_$2" PYTHONPATH "$1/@DIST_PACKAGES@"
  "_minirospy_$2" PATH "$1/bin"
  "_minirospy_$2" LD_LIBRARY_PATH "$1/lib"
  "_minirospy_$2" PKG_CONFIG_PATH "$1/lib/pkgconfig"
  "_minirospy_$2" ROSLISP_PACKAGE_DIRECTORIES "$1/share/common-lisp"
}
"""


def _others_make_way(setup: SetUp) -> str:
    """Return code that, without --extend, replaces the previously sourced workspaces by this workspace's parents."""
    chain = "\n".join(f"  _minirospy_workspace {_quoted(parent)} put" for parent in reversed(setup.parents))
    return f"""if [ "${{1:-}}" != --extend ]; then
  # Remove the workspaces that were sourced before.
  _minirospy_before=${{CMAKE_PREFIX_PATH:-}}
  while [ -n "$_minirospy_before" ]; do
    _minirospy_one=${{_minirospy_before%%:*}}
    case $_minirospy_before in
      *:*) _minirospy_before=${{_minirospy_before#*:}} ;;
      *) _minirospy_before= ;;
    esac
    [ ! -f "$_minirospy_one/.catkin" ] || _minirospy_workspace "$_minirospy_one" take
  done
{chain or "  :"}
fi
"""


def _posix(setup: SetUp, others: str) -> str:
    return (
        _HEAD
        + f'[ -n "${{_minirospy_prefix:-}}" ] || _minirospy_prefix={_quoted(setup.prefix)}\n'
        + _POSIX_FUNCTIONS.replace("@DIST_PACKAGES@", DIST_PACKAGES)
        + _posix_base(setup)
        + others
        + """_minirospy_workspace "$_minirospy_prefix" put
"""
        + "".join(
            f'_minirospy_share={_quoted(folder)}\ncase ":${{ROS_PACKAGE_PATH:-}}:" in\n'
            '  *":$_minirospy_share:"*) ;;\n'
            '  *) export ROS_PACKAGE_PATH="$ROS_PACKAGE_PATH:$_minirospy_share" ;;\nesac\n'
            for folder in setup.share
        )
        + """if [ -d "$_minirospy_prefix/etc/catkin/profile.d" ]; then
  for _minirospy_hook in "$_minirospy_prefix"/etc/catkin/profile.d/*.sh; do
    [ ! -f "$_minirospy_hook" ] || . "$_minirospy_hook"
  done
fi
unset -f _minirospy_put _minirospy_take _minirospy_sources _minirospy_workspace
unset _minirospy_rest _minirospy_kept _minirospy_entry _minirospy_list _minirospy_before _minirospy_one
unset _minirospy_share _minirospy_hook
[ -n "${BASH_VERSION:-}${ZSH_VERSION:-}" ] || unset _minirospy_prefix
"""
    )


def _posix_base(setup: SetUp) -> str:
    programs = _quoted(setup.programs)
    return (
        "".join(f'export {name}="${{{name}:-{value}}}"\n' for name, value in _BASE.items())
        + f'command -v minirospy >/dev/null 2>&1 || export PATH={programs}:"$PATH"\n'
    )


_BASE = {
    "ROS_DISTRO": "noetic",
    "ROS_VERSION": "1",
    "ROS_PYTHON_VERSION": "3",
    "ROS_MASTER_URI": "http://localhost:11311",
}


def _posix_assignment(name: str, value: str) -> str:
    return f"export {name}={shlex.quote(value)}"


def _quoted(path: Path) -> str:
    """Return a path as a single word for a POSIX shell."""
    return "'" + str(path).replace("'", "'\\''") + "'"


# --- fish


def _fish(setup: SetUp) -> str:
    chain = "\n".join(
        f"    _minirospy_workspace {_fish_quoted(parent)} put" for parent in reversed(setup.parents)
    )

    return (
        _HEAD
        + "set -l _minirospy_prefix (builtin realpath (dirname (status filename)))\n"
        + _FISH_FUNCTIONS.replace("@DIST_PACKAGES@", DIST_PACKAGES)
        + _fish_base(setup)
        + f"""if test "$argv[1]" != --extend
    for one in $CMAKE_PREFIX_PATH
        test -f $one/.catkin; and _minirospy_workspace $one take
    end
{chain or "    true"}
end
_minirospy_workspace $_minirospy_prefix put
"""
        + "".join(
            f"contains {_fish_quoted(folder)} $ROS_PACKAGE_PATH; or set -gx --path --append ROS_PACKAGE_PATH "
            f"{_fish_quoted(folder)}\n"
            for folder in setup.share
        )
        + "functions -e _minirospy_put _minirospy_take _minirospy_workspace\n"
        + f"source {_fish_quoted(setup.functions / 'ros.fish')}\n"
    )


_FISH_FUNCTIONS = """function _minirospy_take -a variable entry
    set -l kept
    for each in $$variable
        test "$each" = "$entry"; or set -a kept $each
    end
    if test -n "$kept"
        set -gx --path $variable $kept
    else
        set -e $variable
    end
end
function _minirospy_put -a variable entry
    _minirospy_take $variable $entry
    set -gx --path $variable $entry $$variable
end
function _minirospy_workspace -a prefix action
    for variable in CMAKE_PREFIX_PATH ROS_PACKAGE_PATH PYTHONPATH LD_LIBRARY_PATH PKG_CONFIG_PATH \\
        ROSLISP_PACKAGE_DIRECTORIES
        set -q $variable; and set -gx --path $variable $$variable
    end
    for folder in (string split ';' (cat $prefix/.catkin))[-1..1]
        _minirospy_$action ROS_PACKAGE_PATH $folder
    end
    _minirospy_$action CMAKE_PREFIX_PATH $prefix
    _minirospy_$action PYTHONPATH $prefix/@DIST_PACKAGES@
    _minirospy_$action PATH $prefix/bin
    _minirospy_$action LD_LIBRARY_PATH $prefix/lib
    _minirospy_$action PKG_CONFIG_PATH $prefix/lib/pkgconfig
    _minirospy_$action ROSLISP_PACKAGE_DIRECTORIES $prefix/share/common-lisp
end
set -q CMAKE_PREFIX_PATH; and set -gx --path CMAKE_PREFIX_PATH $CMAKE_PREFIX_PATH
"""


def _fish_base(setup: SetUp) -> str:
    return (
        "".join(f"set -q {name}; or set -gx {name} {value}\n" for name, value in _BASE.items())
        + f"command -q minirospy; or set -gx PATH {_fish_quoted(setup.programs)} $PATH\n"
    )


def _fish_assignment(name: str, value: str) -> str:
    return f"set -gx {name} {_fish_quoted(value)}"


def _fish_quoted(path: Path | str) -> str:
    """Return a path as a single word for fish, whose single quotes, unlike those of other shells, support two escapes."""
    return "'" + str(path).replace("\\", "\\\\").replace("'", "\\'") + "'"


# --- PowerShell


def _ps1(setup: SetUp, *, extends: bool) -> str:
    base = powershell.powershell_base(_BASE, setup.programs)
    return powershell.powershell_setup(
        base, setup.parents, setup.share, setup.functions, DIST_PACKAGES, extends=extends
    )


# --- cmd.exe


def _bat_assignment(name: str, value: str) -> str:
    # In a batch file, a single % would start a variable. Because of the quotes, & and | do not end the command.
    return '@set "{}={}"'.format(name, value.replace("%", "%%"))


def _others_make_way_bat(setup: SetUp) -> str:
    chain = "".join(f'call :minirospy_workspace put "{parent}"\n' for parent in reversed(setup.parents))
    return f"""if "%~1"=="--extend" goto minirospy_own
if not defined CMAKE_PREFIX_PATH goto minirospy_below
rem Remove the workspaces that were sourced before.
for %%P in ("%CMAKE_PREFIX_PATH:;=" "%") do if exist "%%~P\\.catkin" call :minirospy_workspace take "%%~P"
:minirospy_below
{chain}:minirospy_own
"""


def _bat(setup: SetUp, others: str) -> str:
    share = "".join(f'call :minirospy_last ROS_PACKAGE_PATH "{folder}"\n' for folder in setup.share)
    text = _BAT.format(
        base=_bat_base(setup), others=others, share=share, functions=setup.functions / "ros.bat"
    )
    # cmd.exe does not find labels in a file with LF line endings, so use CRLF.
    return text.replace("@DIST_PACKAGES@", DIST_PACKAGES.replace("/", "\\")).replace("\n", "\r\n")


_BAT = """@echo off
rem Made by minirospy: `call` it to work with the packages of this workspace.
{base}{others}for %%P in ("%~dp0.") do call :minirospy_workspace put "%%~fP"
{share}call "{functions}"
exit /b 0

rem put or take PREFIX: all variables of one workspace; its file .catkin names the folders of packages.
:minirospy_workspace
for /f "usebackq delims=" %%L in ("%~2\\.catkin") do set "MINIROSPY_SOURCES=%%L"
for %%S in ("%MINIROSPY_SOURCES:;=" "%") do call :minirospy_%~1 ROS_PACKAGE_PATH "%%~S"
set "MINIROSPY_SOURCES="
call :minirospy_%~1 CMAKE_PREFIX_PATH "%~2"
call :minirospy_%~1 PYTHONPATH "%~2\\@DIST_PACKAGES@"
call :minirospy_%~1 PATH "%~2\\bin"
exit /b 0

rem VARIABLE ENTRY: put it in front, and take it away where it was before.
:minirospy_put
call :minirospy_take %1 %2
if defined %~1 (call set "%~1=%~2;%%%~1%%") else set "%~1=%~2"
exit /b 0

rem VARIABLE ENTRY: put it at the end, and take it away where it was before.
:minirospy_last
call :minirospy_take %1 %2
if defined %~1 (call set "%~1=%%%~1%%;%~2") else set "%~1=%~2"
exit /b 0

rem VARIABLE ENTRY: remove it. What call runs is parsed twice: %% is the % of the second time.
:minirospy_take
if not defined %~1 exit /b 0
call set "MINIROSPY_REST=;%%%~1%%;"
call set "MINIROSPY_REST=%%MINIROSPY_REST:;%~2;=;%%"
set "MINIROSPY_REST=%MINIROSPY_REST:~1,-1%"
if defined MINIROSPY_REST (call set "%~1=%%MINIROSPY_REST%%") else set "%~1="
set "MINIROSPY_REST="
exit /b 0
"""


def _bat_base(setup: SetUp) -> str:
    return "".join(f'if not defined {name} set "{name}={value}"\n' for name, value in _BASE.items()) + (
        f'where minirospy >nul 2>nul || set "PATH={setup.programs};%PATH%"\n'
    )
