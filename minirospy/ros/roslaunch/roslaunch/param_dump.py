"""roslaunch.param_dump: the parameters of launch files."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import yaml as yaml

from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.launcher.load import load_files
from minirospy.ros.roslaunch.roslaunch.substitution_args import chosen_packages

__all__ = ["dump_params"]


def dump_params(files: Sequence[str]) -> bool:
    """Print the launch files' parameters as YAML; return whether all files could be loaded."""
    try:
        params = load_files(list(files), {}, chosen_packages()).params
    except MinirospyError as error:
        print(f"Unable to load file {error}", file=sys.stderr)
        return False
    sys.stdout.write(yaml.safe_dump(params, default_flow_style=False) + "\n")
    return True
