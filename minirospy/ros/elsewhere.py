"""Modules that programs import but minirospy does not provide; importing one raises ImportError with advice.

The modules' names and messages are in `workspace/elsewhere.py`. If the real module is installed, it takes precedence.
"""

from __future__ import annotations

from typing import NoReturn

from minirospy.workspace.elsewhere import IMPORTED, SUBMODULES, advice

__all__: list[str] = []


def __getattr__(name: str) -> NoReturn:
    """Raise ImportError for a module in `workspace/elsewhere.py` (``pkg_sub`` means ``pkg.sub``), else AttributeError."""
    if name in IMPORTED:
        raise ImportError(f"No module named '{name}': {advice(name)}", name=name)
    submodule = name.replace("_", ".", 1)
    if submodule in SUBMODULES:
        raise ImportError(
            f"minirospy does not have the module '{submodule}': {SUBMODULES[submodule]}", name=submodule
        )
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
