"""The base class of hardware drivers."""
