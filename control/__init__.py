"""The pushing law and the fixed-rate loop that applies it.

Everything here is pure (no clock, socket, random or thread) except `control.loop`.
"""
