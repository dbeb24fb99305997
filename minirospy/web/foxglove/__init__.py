"""The Foxglove WebSocket protocol: a pure part (``protocol.py``), and the clients' sessions."""
