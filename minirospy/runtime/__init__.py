"""The I/O layer: one asyncio loop per process, sockets, XML-RPC, nodes, the master."""
