"""The three devices of level sim: drivers that read the world directly."""
