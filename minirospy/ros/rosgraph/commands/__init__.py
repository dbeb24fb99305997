"""The commands of the package rosgraph."""
