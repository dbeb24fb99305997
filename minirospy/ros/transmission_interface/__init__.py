"""Conversions between actuators and joints."""
