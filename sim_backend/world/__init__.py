"""One simulated world for all devices: base, slider, sensor model and the scene a rig describes."""
