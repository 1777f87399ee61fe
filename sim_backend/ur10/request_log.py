"""A record of what clients sent to the emulated controller, so that a test can check what was never sent."""

from __future__ import annotations

from collections import deque


class RequestLog:
    """Notable requests of the clients; the newest 2000 lines of each list."""

    def __init__(self) -> None:
        self.handshake: deque[str] = deque(maxlen=2000)
        """RTDE requests as text, oldest first."""
        self.dashboard_lines: deque[str] = deque(maxlen=2000)
        self.input_setups = 0
        """RTDE frames of type I."""
        self.input_frames = 0
        """RTDE data frames sent by clients."""
        self.bad_frames = 0
        """RTDE frames that were invalid."""
        self.script_bytes = 0
        self.scripts: deque[str] = deque(maxlen=100)
        """First lines of uploaded programs."""
