"""Messages that came and could not be read: what they are told apart by from messages that never came."""

from __future__ import annotations

from robot_io.errors import DeviceError, DeviceNotReady, DeviceProtocolError

MOST_KEPT = 16
SHOWN_CHARACTERS = 200


class RefusedMessages:
    """Keeps, for the first few refused messages, their text and the reason."""

    def __init__(self) -> None:
        self._kept: list[tuple[str, str]] = []

    def note(self, text: bytes, reason: Exception) -> None:
        """Note a message that was refused; beyond the first few nothing is kept."""
        if len(self._kept) < MOST_KEPT:
            written = text[:4096].decode(errors="replace").replace("\\/", "/")  # JSON may escape a slash
            self._kept.append((written, " ".join(str(reason).split())[:SHOWN_CHARACTERS]))

    def reason_of(self, topic: str) -> str:
        """Return why a message of a topic was refused, "" where none was."""
        return next((reason for text, reason in self._kept if f'"{topic}"' in text), "")

    def explain(self, silent: list[str], where: str, within_s: float) -> DeviceError:
        """Return the error of topics without a usable message: none came, or those that came could not be read."""
        for topic in silent:
            if reason := self.reason_of(topic):
                return DeviceProtocolError(
                    f"messages on {topic} arrived but could not be read ({reason})",
                    where=where,
                    do="Check the publisher: NaN and Infinity are not JSON, and another type has other fields",
                )
        return DeviceNotReady(
            f"no message on {', '.join(silent)} within {within_s:g} s",
            where=where,
            do="Check that its publisher runs (motion capture: is the base seen?) and its name in the rig file",
        )
