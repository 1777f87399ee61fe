"""Faults injected at the edge of a device: what its driver gives is changed before control or the gate sees it."""
