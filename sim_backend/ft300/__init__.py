"""The FT 300 emulated on a pseudo-terminal, byte by byte."""
