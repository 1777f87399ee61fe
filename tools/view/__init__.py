"""Layouts for the viewers of logs, in which a push is on the first screen, and how to open them."""
