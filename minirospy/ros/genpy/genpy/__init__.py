"""genpy: the names that generated message modules import."""
