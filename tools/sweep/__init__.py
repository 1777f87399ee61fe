"""`push sweep` and `push tune`: many pushes of the bare physics, compiled; summarised and drawn."""
