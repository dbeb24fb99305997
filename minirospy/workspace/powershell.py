"""The PowerShell files, ``devel/setup.ps1`` and the environment for ``ros.ps1``, as strings. Pure.

This part of ``setup_files`` supports PowerShell 5.1 and later on Windows, macOS and Linux.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

__all__ = ["assignment", "powershell_base", "powershell_setup", "quoted"]

_HEAD = "# Made by minirospy: `. setup.ps1` to work with the packages of this workspace.\n"

_FUNCTIONS = """function _minirospy_entries([string] $variable) {
    $value = [Environment]::GetEnvironmentVariable($variable)
    if ($value) { $value.Split([IO.Path]::PathSeparator) | Where-Object { $_ } }
}
function _minirospy_set([string] $variable, [string[]] $entries) {
    if ($entries.Count) { Set-Item -LiteralPath "Env:$variable" -Value ($entries -join [IO.Path]::PathSeparator) }
    else { Remove-Item -LiteralPath "Env:$variable" -ErrorAction SilentlyContinue }
}
# VARIABLE ENTRY: remove it.
function _minirospy_take([string] $variable, [string] $entry) {
    _minirospy_set $variable @(_minirospy_entries $variable | Where-Object { $_ -ne $entry })
}
# VARIABLE ENTRY: put it in front, and take it away where it was before.
function _minirospy_put([string] $variable, [string] $entry) {
    _minirospy_set $variable (@($entry) + @(_minirospy_entries $variable | Where-Object { $_ -ne $entry }))
}
# VARIABLE ENTRY: put it at the end where it is not there yet.
function _minirospy_last([string] $variable, [string] $entry) {
    $entries = @(_minirospy_entries $variable)
    if ($entries -notcontains $entry) { _minirospy_set $variable ($entries + @($entry)) }
}
# PREFIX put|take: all variables of one workspace; its file .catkin names the folders of packages.
function _minirospy_workspace([string] $prefix, [string] $action) {
    $sources = @((Get-Content -Raw -LiteralPath (Join-Path $prefix '.catkin')).Trim().Split(';'))
    [array]::Reverse($sources)
    foreach ($folder in $sources) { & "_minirospy_$action" ROS_PACKAGE_PATH $folder }
    & "_minirospy_$action" CMAKE_PREFIX_PATH $prefix
    & "_minirospy_$action" PYTHONPATH (Join-Path $prefix '@DIST_PACKAGES@')
    & "_minirospy_$action" PATH (Join-Path $prefix 'bin')
}
"""

_OTHERS = """if ($args[0] -ne '--extend') {
    # Remove the workspaces that were sourced before.
    foreach ($one in @(_minirospy_entries CMAKE_PREFIX_PATH)) {
        if (Test-Path -LiteralPath (Join-Path $one '.catkin')) { _minirospy_workspace $one take }
    }
@CHAIN@}
"""


def quoted(path: object) -> str:
    """Return a path as a single PowerShell word in single quotes, doubling any quote in the path."""
    return "'" + str(path).replace("'", "''") + "'"


def assignment(name: str, value: str) -> str:
    """Return a statement that sets an environment variable."""
    return f"$env:{name} = {quoted(value)}"


def powershell_base(base: Mapping[str, str], programs: Path) -> str:
    """Return PowerShell code that sets the ROS variables that are unset, and adds minirospy's commands to PATH."""
    variables = "".join(
        f"if (-not $env:{name}) {{ $env:{name} = {quoted(value)} }}\n" for name, value in base.items()
    )
    return variables + (
        "if (-not (Get-Command minirospy -ErrorAction SilentlyContinue)) "
        f"{{ $env:PATH = {quoted(programs)} + [IO.Path]::PathSeparator + $env:PATH }}\n"
    )


def powershell_setup(
    base: str,
    parents: Sequence[Path],
    share: Sequence[Path],
    functions: Path,
    dist_packages: str,
    *,
    extends: bool,
) -> str:
    """Return setup.ps1 or, with ``extends``, local_setup.ps1, which keeps the sourced workspaces."""
    chain = "".join(f"    _minirospy_workspace {quoted(parent)} put\n" for parent in reversed(parents))
    others = "" if extends else _OTHERS.replace("@CHAIN@", chain)
    last = "".join(f"_minirospy_last ROS_PACKAGE_PATH {quoted(folder)}\n" for folder in share)
    return (
        _HEAD
        + _FUNCTIONS.replace("@DIST_PACKAGES@", dist_packages)
        + base
        + others
        + "_minirospy_workspace $PSScriptRoot put\n"
        + last
        + "Remove-Item -Path Function:_minirospy_*\n"
        + f". {quoted(functions / 'ros.ps1')}\n"
    )
