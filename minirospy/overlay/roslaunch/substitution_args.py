"""roslaunch.substitution_args, provided by minirospy: `$(find ...)` and the other substitution arguments."""

from minirospy.ros.roslaunch.roslaunch.loader import convert_value
from minirospy.ros.roslaunch.roslaunch.substitution_args import (
    ArgException,
    SubstitutionException,
    _anon,
    _arg,
    _collect_args,
    _DictWrapper,
    _dirname,
    _env,
    _eval,
    _eval_anon,
    _eval_arg,
    _eval_dict,
    _eval_dirname,
    _eval_env,
    _eval_find,
    _eval_optenv,
    _find,
    _find_executable,
    _find_resource,
    _get_executable_path,
    _get_rospack,
    _optenv,
    _resolve_args,
    _rospack,
    _sanitize_path,
    _separate_first_path,
    _split_command,
    resolve_args,
)

__all__ = ["ArgException", "SubstitutionException", "convert_value", "resolve_args"]
