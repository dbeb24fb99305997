"""The commands of the package rosconsole."""
