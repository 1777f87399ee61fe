"""Writing and decoding a run's log: topics derived from ticks, the scene and the simulated world."""
