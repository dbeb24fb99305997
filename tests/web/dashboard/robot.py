"""A robot for tests of the dashboard: joints with limits, continuous, prismatic, fixed, and a mimic joint."""

from __future__ import annotations

__all__ = ["ROBOT"]

ROBOT = """<robot name="crane">
  <link name="base"/><link name="arm"/><link name="disc"/><link name="stage"/><link name="tip"/><link name="plate"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
  <joint name="wheel" type="continuous"><parent link="arm"/><child link="disc"/><axis xyz="0 0 1"/></joint>
  <joint name="lift" type="prismatic"><parent link="arm"/><child link="stage"/><axis xyz="0 0 1"/>
    <limit lower="0.1" upper="0.3" effort="1" velocity="1"/></joint>
  <joint name="finger" type="revolute"><parent link="stage"/><child link="tip"/><axis xyz="0 0 1"/>
    <limit lower="-9" upper="9" effort="1" velocity="1"/><mimic joint="shoulder" multiplier="-2" offset="0.1"/></joint>
  <joint name="bolt" type="fixed"><parent link="base"/><child link="plate"/></joint>
</robot>
"""
