"""Completion of the commands in the shell, and what the shell evaluates to get it."""
