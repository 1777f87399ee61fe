"""The job of the live view's process."""

from __future__ import annotations

import msgspec


class LiveJob(msgspec.Struct, frozen=True):
    """Where to serve, and what."""

    port: int
    feed_fd: int
    """The receiving end of a `LiveFeed`."""
    parent_pid: int
    status_fd: int = -1
