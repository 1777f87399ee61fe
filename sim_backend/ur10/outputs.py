"""Digital and analogue outputs and the speed slider, which RTDE clients, programs and the pendant set.

Source: RTDE guide. A mask says which bits or outputs of the value that comes with it count.
"""

from __future__ import annotations

STANDARD, CONFIGURABLE, TOOL = 0, 8, 16
"""First bit of each kind of digital output in the 18 that the controller reports."""


class Outputs:
    """What is on the terminals: `digital_out` as bits, analogue outputs as a share (0..1) of current or voltage."""

    def __init__(self) -> None:
        self.digital_out = 0
        self.analog_out = [0.0, 0.0]
        self.analog_domain = [0, 0]
        """0: 4..20 mA, 1: 0..10 V."""

    def set_digital(self, first: int, mask: int, bits: int) -> None:
        """Set the masked bits of one kind, `first` being its place."""
        self.digital_out = self.digital_out & ~(mask << first) | (mask & bits) << first

    def set_analog(self, index: int, domain: int, share: float) -> None:
        """Set output 0 or 1."""
        self.analog_domain[index] = domain
        self.analog_out[index] = min(max(share, 0.0), 1.0)

    @property
    def analog_values(self) -> tuple[float, float]:
        """Return what the outputs give: A or V."""
        one, two = (
            share * 10.0 if domain else 0.004 + share * 0.016
            for share, domain in zip(self.analog_out, self.analog_domain, strict=True)
        )
        return one, two


class MaskedInputs:
    """The masks and values that a client sends apart, for the fields of one RTDE packet may come in any order."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}

    def put(self, name: str, value: float) -> None:
        """Store one field."""
        self.values[name] = value

    def get(self, name: str) -> float:
        """Return what was last sent, or 0."""
        return self.values.get(name, 0.0)
