"""Publishers and action servers for loops that must not wait."""
