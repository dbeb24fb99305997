"""The dashboard: one page for the graph and the board, served by the bridge. Its functions: docs/dashboard.md."""
