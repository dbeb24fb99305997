"""Simulated worlds: SDF and URDF descriptions, read into one model that a physics engine can build.

Source: http://sdformat.org/spec, versions 1.4 to 1.7.
"""
