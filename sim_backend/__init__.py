"""The slider model, the simulated world, and the emulators that use the devices' real wire protocols."""
