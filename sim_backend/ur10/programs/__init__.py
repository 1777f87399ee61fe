"""What the emulated controller can run: straight URScript, ur_rtde's control script, programs of the pendant."""
