"""The slider model, the simulated world, and the emulators that speak the devices' real bytes."""
