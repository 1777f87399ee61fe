"""RTDE on the emulated controller (port 30004), protocol versions 1 and 2. Source: Universal Robots RTDE guide.

frame: uint16 length (including these 3 bytes) | uint8 type | payload, all big-endian
"""

from __future__ import annotations

import math
import socket
import struct

from robot_io.clock import monotonic_ns
from robot_io.ipc.event_loop import EventLoop
from sim_backend.ur10.controller import UrController
from sim_backend.ur10.fields import WIRE_FORMAT, Input, Output, Values, input_field, output_field
from sim_backend.ur10.request_log import RequestLog
from sim_backend.ur10.tcp import TcpClient, TcpServer

RTDE_PORT = 30004
DROP_ABOVE_BYTES = 20_000
"""Data frames for a client that leaves more than this unread are dropped."""

_HEADER = struct.Struct(">HB")
_INFO_LEVEL = 3


class OutputRecipe:
    """The variables that a client reads, in its order."""

    def __init__(self, fields: list[Output]) -> None:
        self._fields = fields
        self._layout = struct.Struct(">" + "".join(WIRE_FORMAT[field.type] for field in fields))

    def pack(self, robot: UrController) -> bytes:
        """Return the current values."""
        values: list[float] = []
        for field in self._fields:
            values.extend(field.read(robot))
        return self._layout.pack(*values)


class InputRecipe:
    """The variables that a client writes, in its order."""

    def __init__(self, fields: list[Input]) -> None:
        self._fields = fields
        self._layouts = [struct.Struct(">" + WIRE_FORMAT[field.type]) for field in fields]
        self.size = sum(layout.size for layout in self._layouts)

    def write(self, robot: UrController, data: bytes, now_ns: int) -> None:
        """Write the values to the controller."""
        at = 0
        for field, layout in zip(self._fields, self._layouts, strict=True):
            values: Values = layout.unpack_from(data, at)
            at += layout.size
            field.write(robot, values, now_ns)


class RtdeClient(TcpClient):
    """One RTDE connection: its protocol version, recipes and the inputs it owns."""

    def __init__(self, server: RtdeServer, sock: socket.socket) -> None:
        super().__init__(server, sock)
        self.rtde = server
        self.version = 1
        self.started = False
        self.output: OutputRecipe | None = None
        self.inputs: list[InputRecipe] = []
        self.frequency_hz = server.robot.model.rate_hz
        self.skip_frames = 0
        self.cut_frame_to: int | None = None
        self._due = 0.0
        self._pending = bytearray()

    def on_bytes(self, data: bytes) -> None:
        """See `TcpClient.on_bytes`."""
        self._pending += data
        while self.open and len(self._pending) >= _HEADER.size:
            length, kind = _HEADER.unpack_from(self._pending)
            if length < _HEADER.size:
                self.rtde.requests.bad_frames += 1
                self.close()
                return
            if len(self._pending) < length:
                return
            body = bytes(self._pending[_HEADER.size : length])
            del self._pending[:length]
            self._on_frame(chr(kind), body)

    def on_closed(self) -> None:
        """Release the inputs; their values are kept."""
        self.rtde.owners = {name: owner for name, owner in self.rtde.owners.items() if owner is not self}

    def reply(self, kind: str, body: bytes) -> None:
        """Send one frame."""
        self.send(_HEADER.pack(_HEADER.size + len(body), ord(kind)) + body)

    def send_text(self, text: str, source: str = "controller", level: int = _INFO_LEVEL) -> None:
        """Send a text message frame."""
        message, origin = text.encode()[:255], source.encode()[:255]
        if self.version == 1:
            self.reply("M", bytes([level]) + message)
        else:
            self.reply("M", bytes([len(message)]) + message + bytes([len(origin)]) + origin + bytes([level]))

    def send_data(self) -> None:
        """Send one data frame if this client's rate requires one in this cycle."""
        if not self.started or self.output is None:
            return
        self._due += self.frequency_hz / self.rtde.robot.model.rate_hz
        if self._due < 1.0 - 1e-9:
            return
        self._due -= 1.0
        counters = self.rtde.counters
        if self.skip_frames > 0 or self.queued_bytes > DROP_ABOVE_BYTES:
            self.skip_frames = max(0, self.skip_frames - 1)
            counters["data_dropped"] += 1
            return
        values = self.output.pack(self.rtde.robot)
        if self.cut_frame_to is not None:
            values = values[: self.cut_frame_to]
            self.cut_frame_to = None
        if self.rtde.cut_frames_to is not None:
            values = values[: self.rtde.cut_frames_to]
        self.reply("U", (b"\x01" if self.version == 2 else b"") + values)
        counters["data_sent"] += 1

    def _on_frame(self, kind: str, body: bytes) -> None:
        if kind != "U":
            self.rtde.requests.handshake.append(f"{kind} {body[:60]!r}")
        handler = {
            "V": self._on_protocol,
            "v": self._on_version,
            "O": self._on_outputs,
            "I": self._on_inputs,
            "S": self._on_start,
            "P": self._on_pause,
            "U": self._on_data,
            "M": self._on_text,
        }.get(kind)
        if handler is None:
            self.rtde.requests.bad_frames += 1
        else:
            handler(body)

    def _on_protocol(self, body: bytes) -> None:
        accepted = len(body) == 2 and int.from_bytes(body) in (1, 2)
        if accepted:
            self.version = int.from_bytes(body)
        self.reply("V", bytes([accepted]))

    def _on_version(self, body: bytes) -> None:
        self.reply("v", struct.pack(">4I", *self.rtde.robot.version))

    def _on_outputs(self, body: bytes) -> None:
        most_hz = frequency_hz = self.rtde.robot.model.rate_hz
        if self.version == 2:
            if len(body) < 8:
                self.rtde.requests.bad_frames += 1
                return
            (frequency_hz,) = struct.unpack_from(">d", body)
            body = body[8:]
        names = _names(body)
        fields = [output_field(name, self.rtde.robot.version) for name in names]
        types = ",".join("NOT_FOUND" if field is None else field.type for field in fields)
        found = [field for field in fields if field is not None]
        complete = bool(names) and len(found) == len(names)
        if complete:
            self.output = OutputRecipe(found)
            self.frequency_hz = min(max(frequency_hz, 1.0), most_hz) if math.isfinite(frequency_hz) else most_hz
            self._due = 1.0 - self.frequency_hz / most_hz  # the first frame is sent in the first cycle
        self.reply("O", (bytes([complete]) if self.version == 2 else b"") + types.encode())

    def _on_inputs(self, body: bytes) -> None:
        self.rtde.requests.input_setups += 1
        owners = self.rtde.owners
        names = _names(body)
        types: list[str] = []
        fields: list[Input] = []
        for name in names:
            field = input_field(name)
            if field is None:
                types.append("NOT_FOUND")
            elif owners.get(name, self) is not self:
                types.append("IN_USE")
            else:
                types.append(field.type)
                fields.append(field)
        recipe_id = 0
        if names and len(fields) == len(names) and len(self.inputs) < 255:
            owners.update(dict.fromkeys(names, self))
            self.inputs.append(InputRecipe(fields))
            recipe_id = len(self.inputs)
        self.reply("I", bytes([recipe_id]) + ",".join(types).encode())

    def _on_start(self, body: bytes) -> None:
        self.started = self.output is not None
        self.reply("S", bytes([self.started]))

    def _on_pause(self, body: bytes) -> None:
        self.started = False
        self.reply("P", b"\x01")

    def _on_data(self, body: bytes) -> None:
        requests = self.rtde.requests
        requests.input_frames += 1
        number = body[0] if body else 0
        if not 1 <= number <= len(self.inputs) or len(body) != 1 + self.inputs[number - 1].size:
            requests.bad_frames += 1
            return
        self.inputs[number - 1].write(self.rtde.robot, body[1:], monotonic_ns())

    def _on_text(self, body: bytes) -> None:
        """Ignore a client's text message: it only goes to the robot's log."""


class RtdeServer(TcpServer):
    """The RTDE port: clients, the owner of each input, and the data of each cycle."""

    def __init__(self, loop: EventLoop, host: str, robot: UrController, requests: RequestLog) -> None:
        self.robot = robot
        self.requests = requests
        self.owners: dict[str, object] = {}
        self.muted = False
        self.cut_frames_to: int | None = None
        """Every data frame has only so many bytes of values."""
        self.counters = {"data_sent": 0, "data_dropped": 0}
        self.rtde_clients: list[RtdeClient] = []
        super().__init__(loop, host, RTDE_PORT, self._connect)

    def send_data(self) -> None:
        """Send this cycle's data to every client that has started."""
        self.rtde_clients = [client for client in self.rtde_clients if client.open]
        if not self.muted and not self.frozen:
            for client in self.rtde_clients:
                client.send_data()

    def read_now(self) -> None:
        """Read what clients have already sent, before a late cycle acts on it."""
        for client in tuple(self.rtde_clients):
            client.read_now()

    def _connect(self, server: TcpServer, sock: socket.socket) -> RtdeClient:
        client = RtdeClient(self, sock)
        self.rtde_clients.append(client)
        return client


def _names(body: bytes) -> list[str]:
    """Return the names in a comma-separated list; ur_rtde ends its lists with a comma."""
    return [name.strip() for name in body.decode("ascii", "replace").split(",") if name.strip()]
