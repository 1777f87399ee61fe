"""What a run shows in the terminal and hears from it."""
