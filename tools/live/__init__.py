"""A live view for other viewers: a Foxglove websocket on loopback, in a process of its own."""
