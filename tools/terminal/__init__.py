"""A run's output to the terminal and input from it."""
