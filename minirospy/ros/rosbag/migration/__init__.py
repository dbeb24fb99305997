"""Migrates bags to newer message definitions."""
