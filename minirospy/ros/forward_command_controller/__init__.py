"""Controllers that forward commands to joints."""
