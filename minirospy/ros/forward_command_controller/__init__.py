"""Controllers that pass commands on to joints."""
