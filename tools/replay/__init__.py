"""Re-running the ticks of a log and comparing every byte."""
