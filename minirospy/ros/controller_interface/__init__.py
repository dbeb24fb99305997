"""The base class for user-defined controllers."""
