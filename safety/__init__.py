"""Limits, checks, the supervisor, the envelope and the gate that owns the base connection.

Everything here is pure except `safety.gate_process`.
"""
