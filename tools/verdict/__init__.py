"""What a run is worth: its first cause, the evidence for and against it, and the verdict."""
