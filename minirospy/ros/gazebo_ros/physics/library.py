"""The only module that imports MuJoCo. Its types are ``Any``: the library has no complete annotations."""

from __future__ import annotations

import importlib
from functools import cache
from typing import Any

from minirospy.base.errors import MinirospyError

__all__ = ["SimulationError", "import_context", "load_mujoco"]


class SimulationError(MinirospyError):
    """Raised if a model cannot be simulated, if a name does not exist, or if a library is missing."""


@cache
def load_mujoco() -> Any:
    """Return the module ``mujoco``. Raise SimulationError with the command that installs it if it is missing."""
    try:
        mujoco = importlib.import_module("mujoco")
    except ImportError as error:
        from minirospy.base.installation import install_command

        raise SimulationError(
            f"the simulation needs MuJoCo: {install_command('minirospy[sim]')} ({error})"
        ) from None
    # Invalid states are found after each step. By default, warnings are printed and written to MUJOCO_LOG.TXT.
    mujoco.set_mju_user_warning(lambda text: None)
    return mujoco


def import_context(backend: str) -> Any:
    """Return the class of OpenGL contexts of ``egl``, ``osmesa``, ``glfw`` or ``cgl``.

    Raise any exception: the libraries of OpenGL raise ImportError, AttributeError or errors of their own.
    """
    load_mujoco()
    return importlib.import_module(f"mujoco.{backend}").GLContext
