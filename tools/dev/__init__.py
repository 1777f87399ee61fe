"""What only developers run: pages made from the code."""
