"""Hands to velocities: joysticks, keys, and what makes Twists of them.

Source: http://wiki.ros.org/joy, http://wiki.ros.org/teleop_twist_joy, http://wiki.ros.org/teleop_twist_keyboard.
"""
