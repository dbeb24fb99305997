"""The rosbridge protocol, version 2: JSON, CBOR and PNG over WebSocket, for roslib.js, roslibpy, Unity and MATLAB."""
