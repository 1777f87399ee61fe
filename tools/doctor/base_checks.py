"""The rows of the base: its bridge is subscribed to and asked; nothing is advertised or published."""

from __future__ import annotations

import time

from robot_io.errors import DeviceError
from robot_io.ridgeback.driver import FIRST_MESSAGE_TIMEOUT_S, FRESH_NS, LINK_STALE_NS
from robot_io.ridgeback.look import Heard, RidgebackLook, commands_of_others
from robot_io.ridgeback.sole_command import in_words
from robot_io.rig.config import RigConfig
from tools.doctor.check import Check, Rows
from tools.doctor.feed_checks import judge_feeds

LINGER_S = 11.0
"""ROS keeps a client of the bridge as publisher for 10 s after it has gone."""
ASK_AGAIN_S = 1.0
LISTEN_LEAST_S = 1.5
"""Of a feed that pauses 0.2 s in every 0.4 s this holds two whole pauses, wherever it begins; 1 s may hold one."""
CLOCK_S = 0.1
"""Clocks further apart make stamps of the robot and of this machine hard to compare; nothing in a run compares them."""
ROSAPI_FIX = "Start rosapi beside rosbridge: without it names and types are not checked"
OTHERS_FIX = "End the other program (`rostopic info` of the command topic lists the nodes)"


def base_checks(rig: RigConfig) -> list[Check]:
    """Return the rows of the Ridgeback behind the rig's url; about 5 s, at most 35 s."""
    rows = Rows("base")
    base = rig.base
    try:
        look = RidgebackLook(base.url, base.topics, base.pose_source, rig.frames.base_from_marker)
    except DeviceError as error:
        rows.error("handshake", error)
        return rows.all("the bridge was not reached")
    try:
        rows.ok("handshake", f"{base.url} {look.server}".rstrip(), look.server)
        _timing(rows, look)
        wrong = _types(rows, look)
        _listeners(rows, look)
        heard = look.listen(LISTEN_LEAST_S, FIRST_MESSAGE_TIMEOUT_S)
        _others(rows, look, heard)
        judge_feeds(rows, rig, heard, wrong)
    except DeviceError as error:
        rows.error("handshake", error)
    finally:
        look.close()
    return rows.all("the bridge did not say")


def _timing(rows: Rows, look: RidgebackLook) -> None:
    found = look.round_trip()
    typical_ms, fresh_ms, stale_ms = found.typical_s * 1e3, FRESH_NS / 1e6, LINK_STALE_NS / 1e6
    told = f"{found.by} answers in {typical_ms:.1f} ms, at most {found.worst_s * 1e3:.1f} ms"
    if typical_ms <= fresh_ms:
        rows.ok("round-trip", told, typical_ms, fresh_ms, "ms")
    else:
        fix = "Connect by cable, restart rosbridge, and end other clients that it serves"
        rows.bad("round-trip", "failed" if typical_ms > stale_ms else "warning", told, fix, typical_ms, fresh_ms, "ms")
    if found.ahead_s is None:
        rows.skip("clock", "rosapi did not tell the robot's time")
        return
    told = f"the robot's clock is {abs(found.ahead_s):.3f} s {'ahead' if found.ahead_s >= 0 else 'behind'}"
    if abs(found.ahead_s) <= CLOCK_S:
        rows.ok("clock", told, found.ahead_s, CLOCK_S, "s")
    else:
        fix = "Let chrony set both clocks from one source"
        rows.bad("clock", "warning", told, fix, found.ahead_s, CLOCK_S, "s")


def _types(rows: Rows, look: RidgebackLook) -> dict[str, tuple[str, str] | None]:
    """Judge the command's type; return all that do not fit."""
    wrong = look.wrong_types()
    if look.command not in wrong:
        rows.ok("command-type", f"{look.command} fits")
    elif (pair := wrong[look.command]) is None:
        rows.bad("command-type", "warning", "rosapi did not answer", ROSAPI_FIX)
    else:
        ours, carried = pair
        fix = "Correct base.topics.command_type (or ros_version): the bridge drops other types in silence"
        rows.bad("command-type", "failed", f"{look.command} carries {carried}, the rig file says {ours}", fix, carried)
    return wrong


def _listeners(rows: Rows, look: RidgebackLook) -> None:
    nodes = look.listeners()
    if nodes is None:
        rows.bad("command-listener", "warning", "rosapi did not answer", ROSAPI_FIX)
    elif heard_by := _other_nodes(nodes):
        rows.ok("command-listener", f"{', '.join(heard_by)} subscribes to {look.command}", float(len(heard_by)))
    else:
        fix = "Start the base's software (twist_mux and the wheel controller), or correct base.topics.command"
        rows.bad("command-listener", "failed", f"nothing subscribes to {look.command}", fix, 0.0)


def _others(rows: Rows, look: RidgebackLook, heard: Heard) -> None:
    commands = commands_of_others(heard)
    if commands:
        told = f"somebody commands the base: {len(commands)} velocities heard, the last {in_words(commands[-1].twist)}"
        rows.bad("other-publisher", "failed", told, OTHERS_FIX, float(len(commands)), 0.0)
        return
    nodes, began_s = look.publishers(), time.monotonic()
    while nodes and not _other_nodes(nodes) and time.monotonic() - began_s < LINGER_S:
        time.sleep(ASK_AGAIN_S)  # the bridge's own node: a client that may have gone
        nodes = look.publishers()
    if nodes is None:
        rows.bad("other-publisher", "warning", "rosapi did not answer", ROSAPI_FIX)
    elif others := _other_nodes(nodes):
        told = f"{', '.join(others)} may command the base, too, on {look.command}; silent now"
        rows.bad("other-publisher", "warning", told, OTHERS_FIX, float(len(others)), 0.0)
    elif nodes:
        told = f"another client of the bridge publishes on {look.command}, for {LINGER_S:g} s at least; silent now"
        rows.bad("other-publisher", "warning", told, "End the other client of rosbridge", 1.0, 0.0)
    else:
        rows.ok("other-publisher", f"nobody else publishes on {look.command}", 0.0, 0.0)


def _other_nodes(nodes: list[str]) -> list[str]:
    """Leave out the bridge, which is the node of all its clients."""
    return [node for node in nodes if "rosbridge" not in node]
