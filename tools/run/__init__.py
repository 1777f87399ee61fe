"""The parts of one push: its processes, its initial state and its result."""
