"""Modules that all other packages share: errors, names, times, clocks, the environment."""
