"""RTDE on the emulated controller: the variables, and the port that serves them."""
