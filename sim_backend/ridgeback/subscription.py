"""What one client of the emulated bridge gets of a topic: spaced, queued or dropped."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from robot_io.clock import NS_PER_MS, monotonic_ns
from robot_io.ipc.event_loop import EventLoop, Timer


class ClientSubscription:
    """A client's subscription to a topic: spacing in ms, and how many messages may be queued.

    Several subscribe requests of one client form one subscription with the smallest spacing and queue length of all.
    """

    def __init__(self, loop: EventLoop, send: Callable[[str], None], head: str) -> None:
        self._loop = loop
        self._send = send
        self._head = head
        self._requests: dict[object, tuple[int, int]] = {}
        self._spacing_ns = 0
        self._waiting: deque[str] = deque()
        self._queue_length = 0
        self._last_ns = 0
        self._timer: Timer | None = None

    def add(self, request_id: object, throttle_ms: int, queue_length: int) -> None:
        """Add or replace one request."""
        self._requests[request_id] = (throttle_ms, queue_length)
        self._merge()

    def remove(self, request_id: object) -> bool:
        """Remove one request (None: all); return whether none is left."""
        if request_id is None:
            self._requests.clear()
        self._requests.pop(request_id, None)
        self._merge()
        return not self._requests

    def deliver(self, message_json: str) -> None:
        """Send a message, queue it until it is due, or drop it."""
        now_ns = monotonic_ns()
        due_ns = self._last_ns + self._spacing_ns
        if now_ns >= due_ns and not self._waiting:
            self._send_now(message_json, now_ns)
        elif self._queue_length > 0:
            if len(self._waiting) >= self._queue_length:
                self._waiting.popleft()
            self._waiting.append(message_json)
            if self._timer is None:
                self._timer = self._loop.call_at(due_ns, self._send_waiting)

    def close(self) -> None:
        """Stop sending."""
        self._waiting.clear()
        if self._timer is not None:
            self._timer.cancel()

    def _merge(self) -> None:
        self._spacing_ns = min((throttle for throttle, _ in self._requests.values()), default=0) * NS_PER_MS
        self._queue_length = min((length for _, length in self._requests.values()), default=0)

    def _send_now(self, message_json: str, now_ns: int) -> None:
        self._last_ns = now_ns
        self._send(f"{self._head}{message_json}}}")

    def _send_waiting(self, _: int) -> None:
        self._timer = None
        if self._waiting:
            self._send_now(self._waiting.popleft(), monotonic_ns())
        if self._waiting:
            self._timer = self._loop.call_at(self._last_ns + self._spacing_ns, self._send_waiting)
