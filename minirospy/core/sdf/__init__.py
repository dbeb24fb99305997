"""Simulated worlds: reads SDF and URDF descriptions into one model, from which a physics engine can build the world.

Source: http://sdformat.org/spec, versions 1.4 to 1.7.
"""
