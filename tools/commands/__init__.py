"""The commands of `push`, one module each."""
