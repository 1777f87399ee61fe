"""The `push` program: combines drivers, loop, gate, recorder and emulators; start reading at `tools.run.launcher`."""
