"""Takes in what a bridge sends, a bounded share at a time: a flood cannot hold the process that sends commands."""

from __future__ import annotations

import time
from collections import deque

from robot_io.clock import ClockNs
from robot_io.messages import BaseFeed, Stamped
from robot_io.ridgeback.feeds import FeedReader
from robot_io.ridgeback.rosbridge_codec import Published, decode_frame
from robot_io.ridgeback.websocket_link import MOST_FRAMES, READ_NS, WebSocketLink


class Intake:
    """Reads a link and decodes its messages with `reader`; what exceeds one share waits for the next."""

    def __init__(self, reader: FeedReader, clock: ClockNs) -> None:
        self._reader = reader
        self._clock = clock
        self._undecoded: deque[tuple[bytes, int]] = deque()
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._undecoded.clear()
        self._reader.reset()
        self.counters = {"messages": 0, "undecodable": 0}
        self.newest_inbound_ns = 0
        """When the newest message of any topic arrived; 0 before the first."""
        self.behind_since_ns = 0
        """Since when more has waited than could be taken; 0 while nothing does."""

    def take(self, link: WebSocketLink) -> list[Stamped[BaseFeed]]:
        """Return the samples of at most MOST_FRAMES messages, within about READ_NS of this thread's processor time.

        Never blocks. Raises LinkLost after everything that came before was returned.
        """
        samples: list[Stamped[BaseFeed]] = []
        until_ns = time.thread_time_ns() + READ_NS
        if not self._undecoded:
            self._undecoded.extend(link.receive())
        for _ in range(min(len(self._undecoded), MOST_FRAMES)):
            samples += self._decode(*self._undecoded.popleft())
            if time.thread_time_ns() > until_ns:
                break
        if not (self._undecoded or link.behind):
            self.behind_since_ns = 0
        elif not self.behind_since_ns:
            self.behind_since_ns = self._clock()
        return samples

    def _decode(self, text: bytes, received_ns: int) -> list[Stamped[BaseFeed]]:
        self.counters["messages"] += 1
        try:
            frame = decode_frame(text)
            if not isinstance(frame, Published):
                return []
            self.newest_inbound_ns = received_ns
            return self._reader.read(frame, received_ns)
        except ValueError:
            self.counters["undecodable"] += 1
            return []
