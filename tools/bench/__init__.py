"""The commands `push bench ...`: what the program costs on this machine."""
