"""roslaunch.substitution_args: `$(find ...)` and the other substitution arguments."""

from __future__ import annotations

import os
from typing import Any

from minirospy.errors import NotFoundError
from minirospy.launch.substitution import Substitution, SubstitutionError
from minirospy.workspace.packages import Packages

__all__ = ["ArgException", "SubstitutionException", "resolve_args"]


class SubstitutionException(Exception):
    """A substitution argument cannot be resolved."""


class ArgException(SubstitutionException):
    """An arg that is not set."""


def resolve_args(
    arg_str: str,
    context: dict[str, Any] | None = None,
    resolve_anon: bool = True,
    filename: str | None = None,
) -> str:
    """Return a text with its substitution arguments made; ``context`` may hold the args as ``{"arg": {name: value}}``.

    Raises SubstitutionException, and ArgException where an arg is not set.
    """
    context = {} if context is None else context
    args, anonymous = context.setdefault("arg", {}), context.setdefault("anon", {})
    substitution = Substitution(Packages(), os.environ, filename or "", args, anonymous)
    if "dirname" in arg_str and not filename:
        raise SubstitutionException("Cannot substitute $(dirname), no file/directory information available.")
    try:
        return substitution.apply(arg_str)
    except NotFoundError as error:
        raise SubstitutionException(str(error)) from error
    except SubstitutionError as error:
        unset = substitution.used - set(args)
        raise (ArgException(min(unset)) if unset else SubstitutionException(str(error))) from error
