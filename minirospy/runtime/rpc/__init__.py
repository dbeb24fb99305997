"""XML-RPC over HTTP: the server, the blocking and the asyncio client, the proxies of master and nodes."""
