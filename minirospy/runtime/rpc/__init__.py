"""XML-RPC over HTTP: the server, the blocking and the asyncio client, and the proxies for master and nodes."""
