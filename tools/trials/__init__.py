"""A battery of pushes: one after the other into one folder, with a question between them, and a table at the end."""
