"""Simulation studies: define many pushes, run them on workers, store, summarise and draw the results."""
