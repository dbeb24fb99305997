"""The only module that imports MuJoCo. Its types are ``Any``, because the library's annotations are incomplete."""

from __future__ import annotations

import importlib
from functools import cache
from typing import Any

from minirospy.base.errors import MinirospyError

__all__ = ["SimulationError", "import_context", "load_mujoco"]


class SimulationError(MinirospyError):
    """Raised if a model cannot be simulated, a name does not exist, or a library is missing."""


@cache
def load_mujoco() -> Any:
    """Return the module ``mujoco``. If it is missing, raise SimulationError with the command to install it."""
    try:
        mujoco = importlib.import_module("mujoco")
    except ImportError as error:
        from minirospy.base.installation import install_command

        raise SimulationError(
            f"the simulation needs MuJoCo: {install_command('minirospy[sim]')} ({error})"
        ) from None
    # The simulation checks for invalid states itself; MuJoCo would also print warnings and write MUJOCO_LOG.TXT.
    mujoco.set_mju_user_warning(lambda text: None)
    return mujoco


def import_context(backend: str) -> Any:
    """Return the OpenGL context class for ``egl``, ``osmesa``, ``glfw`` or ``cgl``.

    May raise any exception: the OpenGL libraries raise ImportError, AttributeError or their own errors.
    """
    load_mujoco()
    return importlib.import_module(f"mujoco.{backend}").GLContext
