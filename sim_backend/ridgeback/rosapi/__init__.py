"""The `rosapi` node: what a client of the bridge may ask about topics, nodes, services, types and parameters."""
