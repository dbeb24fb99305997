"""URDF: parse a robot description into links, joints, their tree and its poses. Pure.

Source: http://wiki.ros.org/urdf/XML.
"""
