"""genpy: what generated messages import."""
