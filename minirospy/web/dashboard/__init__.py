"""The dashboard: one page about the graph and the board, served by the bridge. What there is: docs/dashboard.md."""
