"""The Foxglove WebSocket protocol: a pure half (``protocol.py``), and the sessions of its clients."""
