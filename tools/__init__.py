"""The `push` program: composes drivers, loop, gate, recorder and emulators; start at `tools.run.launcher`."""
