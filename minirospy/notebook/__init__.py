"""ROS in Jupyter notebooks: bags as data frames, messages and images as cell output, dashboard views in cells.

Load the extension in the first cell with ``%load_ext minirospy.notebook``, then::

    from minirospy.notebook import frame, view

docs/notebooks.md describes their use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.notebook.frames import frame
from minirospy.notebook.page import view

if TYPE_CHECKING:
    from minirospy.notebook.display import Shell

__all__ = ["frame", "load_ipython_extension", "unload_ipython_extension", "view"]


def load_ipython_extension(shell: Shell) -> None:
    """Display messages as tables and images as pictures, and let an interrupt of ``rospy.spin()`` end only the cell."""
    from minirospy.client.session import current_session
    from minirospy.notebook.display import show_messages

    show_messages(shell)
    current_session().lifecycle.spin_shuts_down = False


def unload_ipython_extension(shell: Shell) -> None:
    """Undo :func:`load_ipython_extension`."""
    from minirospy.client.session import current_session
    from minirospy.notebook.display import hide_messages

    hide_messages(shell)
    current_session().lifecycle.spin_shuts_down = True
