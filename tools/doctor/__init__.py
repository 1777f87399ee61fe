"""`push doctor`: looks at every device of a rig, at this machine and at the rig itself, and moves nothing."""
