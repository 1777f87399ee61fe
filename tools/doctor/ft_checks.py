"""The rows of the force-torque sensor, from what its preflight saw. Its stream is never started."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from msgspec.structs import astuple

from control.tare import AXES, BIAS_SHARE, NOISE_FACTOR, SMALLEST_COUNT, UNITS, add, judge
from robot_io.errors import DeviceError, DeviceUnreachable
from robot_io.ft300.modbus import POWER_CYCLE
from robot_io.ft300.preflight import Ft300Preflight, Heard, Polled, latency_timer_ms
from robot_io.ft300.serial_link import UDEV_RULE
from robot_io.ft300.tcp_link import is_tcp_address
from robot_io.messages import SensorWrench
from robot_io.rig.config import RigConfig
from robot_io.tick import TareSums
from safety.settings import DAMAGED_SHARE, LEAST_RATE_SHARE, LOW_RATE_SHARE
from tools.doctor.check import Check, Rows

LISTEN_S = 1.5
POLL_S = 1.5
TIMER_MS = 1.0
"""What the driver asks an adapter for."""
MEASURED_MS = 4.0
"""Arrivals further apart than this are no timer of 1 ms, even on a busy machine."""
FIND_FIX = "Plug the adapter in: `push doctor --find` lists those there are"
ECHO_FIX = "Turn off the echo of the RS-485 adapter (its receiver must be off while it sends)"
TIMER_FIX = f"As root add this udev rule and replug: {UDEV_RULE}"


def ft_checks(rig: RigConfig) -> list[Check]:
    """Return the rows of the FT 300 at the rig's port; at most 15 s."""
    rows = Rows("ft")
    port = rig.ft.port
    if not _port_is_there(rows, port):
        return rows.all("its port cannot be used")
    try:
        preflight = Ft300Preflight(port)
    except DeviceError as error:
        _refused_port(rows, error)
        return rows.all("its port cannot be opened")
    with preflight:
        _others_on(rows, port)
        try:
            _look(rows, rig, preflight)
        except DeviceUnreachable as error:
            rows.error("port", error)
    return rows.all("the sensor was not reached")


def _port_is_there(rows: Rows, port: str) -> bool:
    """Judge port and permission without opening anything."""
    if "://" in port:
        rows.skip("permission", "a serial server is reached over the network")
        return True
    path, where = Path(port), f"ft300 {port}"
    try:
        is_device = stat.S_ISCHR(path.stat().st_mode)
    except OSError as error:
        missing = error.errno == errno.ENOENT
        what = "there is no such port" if missing else f"it cannot be looked at ({error.strerror})"
        rows.error("port", DeviceUnreachable(what, where=where, do=FIND_FIX))
        return False
    if not is_device:
        rows.error("port", DeviceUnreachable("this is no device", where=where, do=FIND_FIX))
        return False
    real = os.path.realpath(port)
    rows.ok("port", port if real == port else f"{port} is {real}")
    if not os.access(path, os.R_OK | os.W_OK):
        rows.bad(
            "permission", "failed", f"you may not open {real}",
            'Run "sudo usermod -aG dialout $USER" and log in again',
        )  # fmt: skip
        return False
    rows.ok("permission", f"you may read and write {real}")
    return True


def _refused_port(rows: Rows, error: DeviceError) -> None:
    cause = error.__cause__
    busy = isinstance(cause, OSError) and cause.errno in (errno.EAGAIN, errno.EBUSY)
    rows.error("lock" if busy else "port", error)


def _others_on(rows: Rows, port: str) -> None:
    """Judge the lock, which is ours now: a program that takes none may still read bytes away."""
    if is_tcp_address(port):
        rows.ok("port", f"{port} accepts connections")
        rows.skip("lock", "a serial server has its own")
        return
    others = openers(os.path.realpath(port))
    if others:
        rows.bad(
            "lock", "failed", f"open elsewhere, too: {', '.join(others)}",
            "End that program: it takes some of the sensor's bytes away",
        )  # fmt: skip
    else:
        rows.ok("lock", "nobody else has it open")


def openers(real_path: str) -> list[str]:
    """Return the other processes that have a file open, as far as the system lets us see them.

    Whoever made a pty often keeps its near end open: that is the device, not another reader.
    """
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        if process.name == str(os.getpid()):
            continue
        try:
            names = {str(fd.readlink()) for fd in (process / "fd").iterdir()}
            made_it = real_path.startswith("/dev/pts/") and bool(names & {"/dev/ptmx", "/dev/pts/ptmx"})
            if real_path in names and not made_it:
                found.append(f"{(process / 'comm').read_text().strip()} (process {process.name})")
        except OSError:  # not ours to see, or gone
            continue
    return found


def _look(rows: Rows, rig: RigConfig, preflight: Ft300Preflight) -> None:
    heard = preflight.listen(LISTEN_S)
    silent = preflight.quiet() if heard is not None else True
    if preflight.echoes():
        rows.bad("echo", "failed", "what is sent comes back", ECHO_FIX)
        return
    rows.ok("echo", "what is sent does not come back")
    if not silent:
        rows.bad("identity", "failed", "it keeps sending and does not stop on request", POWER_CYCLE)
    else:
        try:
            info = preflight.identify()
        except DeviceError as error:
            rows.error("identity", error)
            silent = False
        else:
            rows.ok("identity", " ".join(filter(None, (info.model, info.version, info.serial))), info.version)
    polled = preflight.poll(POLL_S) if silent else None
    _latency(rows, rig.ft.port, heard, polled)
    _line(rows, rig, heard, polled)
    if polled is not None:
        judge_readings(rows, rig, polled.readings)


def _latency(rows: Rows, port: str, heard: Heard | None, polled: Polled | None) -> None:
    told_ms = None if is_tcp_address(port) else latency_timer_ms(port)
    if is_tcp_address(port):
        rows.skip("latency-timer", "a serial server has its own")
    elif told_ms is not None:
        evidence = f"the adapter's latency timer is {told_ms} ms"
        if told_ms <= TIMER_MS:
            rows.ok("latency-timer", evidence, float(told_ms), TIMER_MS, "ms")
        else:
            rows.bad("latency-timer", "warning", evidence, TIMER_FIX, float(told_ms), TIMER_MS, "ms")
    else:
        measured = [found.bunches_ms for found in (heard, polled) if found is not None and found.bunches_ms is not None]
        if not measured:
            rows.skip("latency-timer", "the system tells none, and too little came to measure it by")
            return
        bunches_ms = round(measured[0], 2)
        evidence = f"bytes arrive {bunches_ms:.1f} ms apart"
        if bunches_ms <= MEASURED_MS:
            rows.ok("latency-timer", f"{evidence}, as with 1 ms or less", bunches_ms, TIMER_MS, "ms")
        else:
            what = f"{evidence}, in bunches: a latency timer of about {bunches_ms:.0f} ms"
            rows.bad("latency-timer", "warning", what, TIMER_FIX, bunches_ms, TIMER_MS, "ms")


def _line(rows: Rows, rig: RigConfig, heard: Heard | None, polled: Polled | None) -> None:
    """Judge how fast readings come, and how many bytes arrive damaged."""
    if heard is not None:
        rate_hz = rig.ft.declared.rate_hz
        judge_rate(rows, heard.rate_hz, rate_hz, "Hz", f"found streaming at {heard.rate_hz:.1f} Hz")
    elif polled is not None and polled.answered:
        share = polled.fresh / polled.asked
        per_s = polled.answered / polled.span_s
        evidence = f"{polled.answered} of {polled.asked} questions answered, {per_s:.0f} a second, {polled.fresh} new"
        if min(rig.scatters[:3]):
            judge_rate(rows, share * 100.0, 100.0, "%", evidence)
        else:
            rows.ok("rate", f"{evidence} (without noise none need differ)")
    elif polled is not None:
        rows.bad("rate", "failed", f"none of {polled.asked} questions answered", POWER_CYCLE, 0.0, None, "%")
    seen = (heard.packets + heard.damaged if heard else 0) + (polled.asked if polled else 0)
    damaged = (heard.damaged if heard else 0) + (polled.damaged if polled else 0)
    if not seen:
        return
    share, most = 100.0 * damaged / seen, 100.0 * DAMAGED_SHARE
    evidence, fix = f"{damaged} of {seen} damaged", "Check cable, shield and grounding, and that nobody else sends"
    if not damaged:
        rows.ok("crc", evidence, share, most, "%")
    else:
        rows.bad("crc", "failed" if share >= most else "warning", evidence, fix, share, most, "%")


def judge_rate(
    rows: Rows, value: float, full: float, unit: str, evidence: str, fix: str = f"Check the cable. {POWER_CYCLE}"
) -> None:
    """Judge a rate, or a share of the readings, by what is full."""
    low, least = LOW_RATE_SHARE * full, LEAST_RATE_SHARE * full
    if value > low:
        rows.ok("rate", evidence, round(value, 1), low, unit)
        return
    rows.bad("rate", "failed" if value <= least else "warning", evidence, fix, round(value, 1), low, unit)


def judge_readings(rows: Rows, rig: RigConfig, readings: tuple[SensorWrench, ...]) -> None:
    """Judge noise and bias as a tare would."""
    if len(readings) < SMALLEST_COUNT:
        return
    facts, sums = rig.ft.declared, TareSums()
    for reading in readings:
        sums = add(sums, astuple(reading), len(readings), facts.resolution)
    unlimited = (float("inf"),) * 6
    judged = judge(sums, rig.ft.noise, unlimited, facts.resolution, rig.scatters)
    limits = [NOISE_FACTOR * max(noise, step / 2) for noise, step in zip(rig.ft.noise, facts.resolution, strict=True)]
    worst = max(range(6), key=lambda i: judged.tare.sd[i] / limits[i])
    sd, limit, unit = judged.tare.sd[worst], limits[worst], UNITS[worst]
    if judged.what:
        rows.bad("noise", "failed", judged.what, judged.do, sd, limit, unit)
    else:
        told = f"{AXES[worst]} scatters by {sd:.3g} {unit} over {len(readings)} readings, steadily"
        rows.ok("noise", told, sd, limit, unit)
    shares = [abs(value) / most for value, most in zip(judged.tare.bias, facts.range, strict=True)]
    axis = max(range(6), key=shares.__getitem__)
    value, limit, unit = judged.tare.bias[axis], BIAS_SHARE * facts.range[axis], UNITS[axis]
    told = f"{AXES[axis]} reads {value:.3g} {unit} at rest, {100.0 * shares[axis]:.0f} % of its range"
    if shares[axis] <= BIAS_SHARE:
        rows.ok("bias", told, value, limit, unit)
    else:
        fix = "Make sure that nothing presses on the tool; power-cycle the sensor"
        rows.bad("bias", "failed", told, fix, value, limit, unit)
