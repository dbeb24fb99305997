"""Raspberry Pi libraries: RPi.GPIO on the virtual board."""
