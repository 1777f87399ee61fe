"""Many simulated pushes: which lanes, how they are spread over workers, what is kept and drawn."""
