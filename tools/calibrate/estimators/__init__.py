"""Estimators of `push calibrate`: readings in, a value with its uncertainty out, or words why not; all pure."""
