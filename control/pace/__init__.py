"""When the loop wakes up, how late it was, and who has been silent for how long."""
