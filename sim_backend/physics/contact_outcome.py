"""The outcome of one step of a ball against a slider."""

from __future__ import annotations

import msgspec

from robot_io.named_values import ContactMode as ContactMode


class ContactOutcome(msgspec.Struct, frozen=True, gc=False):
    """Outcome of one step, WORLD frame: force on the slider (N), and where it acts (m) along which inward normal."""

    mode: ContactMode
    force_x: float = 0.0
    force_y: float = 0.0
    contact_x: float = 0.0
    contact_y: float = 0.0
    normal_x: float = 0.0
    normal_y: float = 0.0

    @property
    def in_contact(self) -> bool:
        """Return whether ball and slider touch; the contact point and the normal are meaningful only then."""
        return self.mode is not ContactMode.FREE


FREE = ContactOutcome(ContactMode.FREE)
