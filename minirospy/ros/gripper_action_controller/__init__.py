"""Controllers of grippers with one joint."""
