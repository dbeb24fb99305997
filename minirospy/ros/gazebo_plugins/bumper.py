"""libgazebo_ros_bumper.so: publishes the contacts of collisions."""

from __future__ import annotations

from gazebo_msgs.msg import ContactsState, ContactState
from geometry_msgs.msg import Wrench

from minirospy.ros.gazebo_ros.messages import to_vector
from minirospy.ros.gazebo_ros.plugins import SensorPlugin

__all__ = ["Bumper"]


class Bumper(SensorPlugin):
    """libgazebo_ros_bumper.so. Parameters: bumperTopicName, frameName. All vectors are in the world frame."""

    def load(self) -> None:
        """Find the collisions; ``<contact>`` may list several."""
        self.simulation.records_details = True
        contact = self.sensor.element.first("contact")
        names = [each.text.strip() for each in contact.all("collision")] if contact is not None else []
        link = self.sensor_link
        known = {each.name for each in link.record.collisions}
        # sdformat renames collisions when it merges links. If none of the names is known, use all collisions of the link.
        chosen = known.intersection(names) or known
        self._collisions = {f"{link.scoped_name}::{name}" for name in chosen}
        self._frame = self.frame("frameName", "world")
        self._publisher = self.output_to(self.text("bumperTopicName", "bumper_states"), ContactsState)

    def sense(self) -> None:
        """Publish the contacts, even if there are none."""
        message = ContactsState(header=self.header(self._frame))
        for contact in self.simulation.contacts():
            if not self._collisions.intersection((contact.collision1, contact.collision2)):
                continue
            state = ContactState(collision1_name=contact.collision1, collision2_name=contact.collision2)
            state.info = (
                f"Debug:  i:(0/1)     my geom:{contact.collision1}   other geom:{contact.collision2}"
                f"         time:{self.simulation.time}"
            )
            state.contact_positions = [to_vector(each) for each in contact.positions]
            state.contact_normals = [to_vector(each) for each in contact.normals]
            state.depths = list(contact.depths)
            state.wrenches = [
                Wrench(to_vector(each.force), to_vector(each.torque)) for each in contact.wrenches
            ]
            for part in ("force", "torque"):
                total = getattr(state.total_wrench, part)
                for wrench in contact.wrenches:
                    x, y, z = getattr(wrench, part)
                    total.x, total.y, total.z = total.x + x, total.y + y, total.z + z
            message.states.append(state)
        self._publisher.publish(message)
