"""What one push is made of: its processes, its folder, its state and its end."""
