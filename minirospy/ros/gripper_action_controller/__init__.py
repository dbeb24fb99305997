"""Controllers for grippers with one joint."""
