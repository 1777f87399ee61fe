"""The Ridgeback emulated behind a rosbridge websocket server."""
