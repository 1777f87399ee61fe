"""The three devices of level sim: drivers that ask the world directly."""
