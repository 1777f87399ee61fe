"""The ports 30001, 30002 and 30003 of the emulated controller: programs in, the robot's state and messages out."""
