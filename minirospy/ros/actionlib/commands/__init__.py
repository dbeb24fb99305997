"""The commands of the package actionlib."""
