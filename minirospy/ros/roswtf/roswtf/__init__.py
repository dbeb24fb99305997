"""roswtf: finds problems in a graph. Source: http://wiki.ros.org/roswtf."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.roswtf.roswtf.context import WtfContext

__all__ = [
    "print_results",
    "roswtf_main",
    "yaml_results",
]


def roswtf_main() -> None:
    """Run the command with this process's arguments and exit."""
    import sys

    from minirospy.ros.roswtf.commands.doctor import roswtf

    sys.exit(roswtf())


def yaml_results(ctx: WtfContext) -> None:
    """Print a context's warnings as YAML."""
    import yaml

    names = ctx.as_dictionary()
    warnings = {each.format_msg % names: each.return_val for each in ctx.warnings}
    print(yaml.dump({"errors": {}, "warnings": warnings}))


def print_results(ctx: WtfContext) -> None:
    """Print a context's warnings and errors."""
    if not ctx.warnings and not ctx.errors:
        print("No errors or warnings")
    if ctx.warnings:
        print(
            f"Found {len(ctx.warnings)} warning(s).\n"
            "Warnings are things that may be just fine, but are sometimes at fault\n"
        )
        for warning in ctx.warnings:
            print("\033[1mWARNING\033[0m", warning.msg)
        print()
    if ctx.errors:
        print(f"Found {len(ctx.errors)} error(s).\n")
        for error in ctx.errors:
            print("\033[31m\033[1mERROR\033[0m", error.msg)
