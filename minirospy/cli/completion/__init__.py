"""Tab completion of the commands, and the shell code that enables it."""
