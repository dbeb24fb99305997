"""URDF: the text of a robot's description -> links, joints, their tree and its poses. Pure.

Source: http://wiki.ros.org/urdf/XML.
"""
