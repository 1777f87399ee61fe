"""What clients asked of the emulated controller, kept so that a test can say what was never sent."""

from __future__ import annotations

from collections import deque


class RequestLog:
    """Everything of note that clients sent; the newest 2000 lines of each list."""

    def __init__(self) -> None:
        self.handshake: deque[str] = deque(maxlen=2000)
        """RTDE requests in words, oldest first."""
        self.dashboard_lines: deque[str] = deque(maxlen=2000)
        self.input_setups = 0
        """RTDE frames of type I."""
        self.input_frames = 0
        """RTDE data frames sent by clients."""
        self.bad_frames = 0
        """RTDE frames that made no sense."""
        self.script_bytes = 0
        self.scripts: deque[str] = deque(maxlen=100)
        """First lines of uploaded programs."""
