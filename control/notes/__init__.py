"""What is noted of a whole run while it ticks: events, counts, how it went beside its path."""
