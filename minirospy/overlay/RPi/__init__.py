"""Raspberry Pi libraries: RPi.GPIO on the virtual board."""
# ruff: noqa: N999 - the name of the real package
