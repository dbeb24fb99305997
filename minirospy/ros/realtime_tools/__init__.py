"""Publishers for loops that must not wait."""
