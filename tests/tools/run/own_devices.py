"""An arm and a base of another maker, over UDP in JSON, each with its emulator: what docs/add-a-device.md asks for."""

from __future__ import annotations

import contextlib
import json
import math
import socket

from robot_io.clock import monotonic_ns
from robot_io.driver import DriverBase
from robot_io.errors import DeviceError, DeviceUnreachable
from robot_io.messages import (
    ArmState,
    BaseOdometry,
    BasePose,
    BaseReport,
    BaseStatus,
    BodyTwist,
    DeviceHealth,
    DeviceInfo,
    JointState,
    LinkState,
    Pose2D,
    Stamped,
)


class UdpDevice(DriverBase):
    """What the two drivers share: say hello, get JSON from then on."""

    name = ""

    def __init__(self, address):
        self.address, self.options = address, {}
        self.socket = None
        self.state, self.cause, self.seq, self.running = LinkState.CLOSED, "", 0, False
        self.before_close = None
        self.sent_ns = self.newest_inbound_ns = self.newest_pong_ns = 0

    @classmethod
    def from_rig(cls, address, options):
        made = cls(address)
        made.options = dict(options)
        return made

    def open(self):
        self.close()
        host, _, port = self.address.rpartition(":")
        self.socket = socket.socket(type=socket.SOCK_DGRAM)
        self.socket.settimeout(1.0)
        try:
            self.socket.connect((host, int(port)))
            self.socket.send(b"{}")
            self.socket.recv(2048)
        except (OSError, ValueError) as error:
            self.close()
            raise DeviceUnreachable(f"no state: {error}", where=self.address, do="Check its address") from None
        self.socket.setblocking(False)
        self.state, self.cause = LinkState.UP, ""
        return DeviceInfo(self.name, self.address)

    def start(self):
        if self.state != LinkState.UP:
            raise DeviceError("it is not open", where=self.address)
        self.running = True

    def fileno(self):
        return self.socket.fileno()

    def messages(self):
        found = []
        with contextlib.suppress(BlockingIOError):
            while self.running and self.state == LinkState.UP and len(found) < 100:
                found.append(json.loads(self.socket.recv(2048)))
        if found:
            self.newest_inbound_ns = monotonic_ns()
        return found

    def health(self):
        return DeviceHealth(self.state, self.cause, {"messages": self.seq}, 100.0 if self.running else 0.0)

    def stop(self):
        self.running = False

    def close(self):
        self.stop()
        if self.socket is not None:
            if self.before_close is not None:
                self.before_close(self.socket.fileno())
            self.socket.close()
            self.socket = None
        self.state = LinkState.CLOSED


class UdpEmulator:
    period_s = 0.01

    def __init__(self, world, options):
        self.world, self.options, self.counters, self.client = world, options, {"sent": 0}, None
        self.socket = socket.socket(type=socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.address = "{}:{}".format(*self.socket.getsockname())

    def tick(self, now_ns):
        with contextlib.suppress(BlockingIOError):
            while True:
                heard, self.client = self.socket.recvfrom(2048)
                self.hear(json.loads(heard), now_ns)
        if self.client is not None:
            self.counters["sent"] += 1
            with contextlib.suppress(OSError):
                self.socket.sendto(json.dumps(self.say(now_ns)).encode(), self.client)

    def hear(self, heard, now_ns):
        pass

    def close(self):
        self.socket.close()


class EmulatedArm(UdpEmulator):
    def say(self, now_ns):
        truth = self.world.read_arm(now_ns)
        free_after = self.options.get("free_after", math.inf)
        mode = "free" if self.counters["sent"] > free_after else "held"
        return {"q": truth.position, "qd": truth.velocity, "mode": mode, "t": now_ns * 1e-9}


class Arm(UdpDevice):
    name = "own_devices:Arm"
    Emulator = EmulatedArm

    def drain(self):
        samples = []
        for message in self.messages():
            self.seq += 1
            state = ArmState.HOLDING if message["mode"] == "held" else ArmState.MOVING
            joints = JointState(tuple(message["q"]), tuple(message["qd"]), int(state), 0, message["t"])
            samples.append(Stamped(joints, self.seq, self.newest_inbound_ns, message["t"]))
        return tuple(samples)


class EmulatedBase(UdpEmulator):
    def hear(self, heard, now_ns):
        if "v" in heard:
            self.world.command_base(BodyTwist(*heard["v"]), now_ns)

    def say(self, now_ns):
        truth = self.world.read_base(now_ns)
        pose, twist = truth.pose, truth.twist
        return {"pose": (pose.x, pose.y, pose.yaw), "twist": (twist.vx, twist.vy, twist.omega)}


class Base(UdpDevice):
    name = "own_devices:Base"
    Emulator = EmulatedBase

    def drain(self):
        samples = []
        for message in self.messages():
            self.seq += 1
            values = (
                BasePose(Pose2D(*message["pose"])),
                BaseOdometry(BodyTwist(*message["twist"])),
                BaseReport(BaseStatus(False, True, 26.0)),
            )
            samples += [Stamped(value, self.seq, self.newest_inbound_ns) for value in values]
        return tuple(samples)

    def command(self, wanted):
        if not all(map(math.isfinite, (wanted.vx, wanted.vy, wanted.omega))):
            raise ValueError("not finite")
        if self.state != LinkState.UP or not self.running:
            return BodyTwist()
        self.socket.send(json.dumps({"v": (wanted.vx, wanted.vy, wanted.omega)}).encode())
        self.sent_ns = monotonic_ns()
        return wanted

    def stop(self):
        if self.running:
            with contextlib.suppress(OSError):
                self.command(BodyTwist())
        super().stop()
