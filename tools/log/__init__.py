"""What a run writes and how it is decoded: topics of the tick, of the scene, of the world."""
