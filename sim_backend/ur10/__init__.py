"""The UR10 controller emulated over TCP: RTDE, dashboard and script ports."""
