"""`push calibrate`: measures the constants of a rig (tare, frames, contact point, path) and commands no motion."""
