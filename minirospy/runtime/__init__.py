"""The shells that move bytes: one asyncio loop a process, sockets, XML-RPC, nodes, the master."""
