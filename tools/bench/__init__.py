"""Measures this machine: one module a command (`push bench sim`, `push bench physics`, `push bench loop`)."""
