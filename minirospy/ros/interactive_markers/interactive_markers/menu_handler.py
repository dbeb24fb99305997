"""Menus for interactive markers: entries, checkboxes, and callbacks for selected entries."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from visualization_msgs.msg import InteractiveMarkerFeedback, MenuEntry

from minirospy import client as rospy
from minirospy.ros.interactive_markers.interactive_markers.interactive_marker_server import (
    InteractiveMarkerServer,
)

__all__ = ["EntryContext", "MenuHandler"]

Callback = Callable[[InteractiveMarkerFeedback], object]


@dataclass
class EntryContext:
    """A menu entry."""

    title: str = ""
    command: str = ""
    command_type: int = 0
    sub_entries: list[int] = field(default_factory=list)
    visible: bool = True
    check_state: int = 0
    feedback_cb: Callback | None = None


class MenuHandler:
    """A menu that ``apply`` attaches to markers. Each entry has a handle, an integer; the first handle is 1."""

    NO_CHECKBOX = 0
    CHECKED = 1
    UNCHECKED = 2

    def __init__(self) -> None:
        self.top_level_handles_: list[int] = []
        self.entry_contexts_: dict[int, EntryContext] = {}
        self.current_handle_ = 1
        self.managed_markers_: set[str] = set()

    def insert(
        self,
        title: str,
        parent: int | None = None,
        command_type: int = MenuEntry.FEEDBACK,
        command: str = "",
        callback: Callback | None = None,
    ) -> int | None:
        """Add an entry, below ``parent`` if given; return the entry's handle, or None if the parent does not exist."""
        handle = self.doInsert(title, command_type, command, callback)
        if parent is None:
            self.top_level_handles_.append(handle)
        elif parent in self.entry_contexts_:
            self.entry_contexts_[parent].sub_entries.append(handle)
        else:
            rospy.logerr(f"Parent menu entry {parent} not found.")
            return None
        return handle

    def doInsert(self, title: str, command_type: int, command: str, feedback_cb: Callback | None) -> int:
        """Create an entry without adding it to a menu; return its handle."""
        handle = self.current_handle_
        self.current_handle_ += 1
        self.entry_contexts_[handle] = EntryContext(title, command, command_type, feedback_cb=feedback_cb)
        return handle

    def setVisible(self, handle: int, visible: bool) -> bool:
        """Show or hide an entry; return whether it exists."""
        if handle not in self.entry_contexts_:
            return False
        self.entry_contexts_[handle].visible = visible
        return True

    def setCheckState(self, handle: int, check_state: int) -> bool:
        """Set the check state to NO_CHECKBOX, CHECKED or UNCHECKED; return whether the entry exists."""
        if handle not in self.entry_contexts_:
            return False
        self.entry_contexts_[handle].check_state = check_state
        return True

    def getCheckState(self, handle: int) -> int | None:
        """Return NO_CHECKBOX, CHECKED or UNCHECKED, or None if the entry does not exist."""
        context = self.entry_contexts_.get(handle)
        return context.check_state if context else None

    def getTitle(self, handle: int) -> str | None:
        """Return an entry's title, or None if the entry does not exist."""
        context = self.entry_contexts_.get(handle)
        return context.title if context else None

    def apply(self, server: InteractiveMarkerServer, marker_name: str) -> bool:
        """Attach the menu in its current state to a marker; return whether the marker exists.

        ``applyChanges`` publishes the change.
        """
        marker = server.get(marker_name)
        if not marker:
            self.managed_markers_.discard(marker_name)
            return False
        marker.menu_entries = []
        self.pushMenuEntries(self.top_level_handles_, marker.menu_entries, 0)
        server.insert(marker, self.processFeedback, InteractiveMarkerFeedback.MENU_SELECT)
        self.managed_markers_.add(marker_name)
        return True

    def reApply(self, server: InteractiveMarkerServer) -> bool:
        """Update the menu on all markers that use it; return whether all of them still exist."""
        # Build a list first, because all() with a generator would stop at a missing marker.
        found = [self.apply(server, marker) for marker in list(self.managed_markers_)]
        return all(found)

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Call the selected entry's callback."""
        context = self.entry_contexts_.get(feedback.menu_entry_id)
        if context is not None and context.feedback_cb is not None:
            context.feedback_cb(feedback)

    def pushMenuEntries(
        self, handles_in: Iterable[int], entries_out: list[MenuEntry], parent_handle: int
    ) -> bool:
        """Append the messages for entries and their submenus; return whether all entries exist."""
        for handle in handles_in:
            context = self.entry_contexts_.get(handle)
            if context is None:
                rospy.logerr("Internal error: context handle not found! This is a bug in MenuHandler.")
                return False
            if context.visible:
                entries_out.append(self.makeEntry(context, handle, parent_handle))
                if not self.pushMenuEntries(context.sub_entries, entries_out, handle):
                    return False
        return True

    def makeEntry(self, context: EntryContext, handle: int, parent_handle: int) -> MenuEntry:
        """Return the MenuEntry message for an entry, with the checkbox in its title."""
        box = {self.CHECKED: "[x] ", self.UNCHECKED: "[ ] "}.get(context.check_state, "")
        return MenuEntry(
            id=handle,
            parent_id=parent_handle,
            title=box + context.title,
            command=context.command,
            command_type=context.command_type,
        )
