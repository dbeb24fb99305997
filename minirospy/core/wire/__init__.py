"""Pure protocols: bytes in, events out. Imports no asyncio, no socket, no threading."""
