"""WebSocket and HTTP, without ROS: listeners, connections, queues of what is to be sent, and who may connect."""
