"""XML-RPC over HTTP: the server, the blocking client and the asyncio client, and the proxies for master and nodes."""
