"""The dashboard, a web page for the graph and the board, served by the bridge. docs/dashboard.md describes its functions."""
