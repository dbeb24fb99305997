"""What all rooms share: errors, names, times, clocks, the environment."""
