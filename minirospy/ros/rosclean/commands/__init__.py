"""The commands of the package rosclean."""
