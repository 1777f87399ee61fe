"""Drivers, messages, configuration and the log: everything that touches the outside world.

This package imports nothing else of the project, and each driver is useful on its own.
"""
