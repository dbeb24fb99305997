"""Migration of bags to newer message definitions."""
