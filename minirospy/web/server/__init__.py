"""WebSocket and HTTP, without ROS: listeners, connections, output queues, and limits on clients."""
