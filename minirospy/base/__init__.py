"""Modules that all other packages use: errors, names, times, clocks, the environment."""
