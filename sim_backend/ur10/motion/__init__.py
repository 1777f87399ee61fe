"""How the emulated arm moves: kinematics both ways, commands, and the limits that end them. Pure."""
