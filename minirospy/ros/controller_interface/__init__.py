"""The base class of controllers, for controllers of the user's own."""
