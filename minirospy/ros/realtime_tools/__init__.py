"""Publishers and action servers for control loops, which must not block."""
