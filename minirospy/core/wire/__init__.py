"""Pure protocols: they parse bytes into events. Imports no asyncio, no socket, no threading."""
