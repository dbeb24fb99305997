"""The master: its server, its calls to nodes, its journal, and /rosout."""
