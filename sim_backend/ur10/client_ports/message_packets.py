"""Messages of the primary port as bytes, and the version message that greets on ports 30001 and 30002.

Source: Universal Robots client interface manual, CB3 and e-Series.

packet: int32 length (of all) | uint8 20 | uint64 timestamp | uint8 source | uint8 kind | body
"""

from __future__ import annotations

import struct

from sim_backend.ur10.models import Version
from sim_backend.ur10.reports import ErrorCode, KeyReport, ProgramError, Report, SafetyModeReport, TextReport

_HEADER = struct.Struct(">iBQBB")
_ROBOT_MESSAGE = 20
_CONTROLLER = 254
"""Source: the controller itself."""
_INTERPRETER = 253
"""Source: the runtime machine, which runs programs."""
_TEXT, _VERSION, _SAFETY_MODE, _ERROR_CODE, _KEY, _RUNTIME_EXCEPTION = 0, 3, 5, 6, 7, 10


def version_message(version: Version, date: str, time_ns: int) -> bytes:
    """Return the message that tells a client which software it has reached."""
    major, minor, bugfix, build = version
    name = b"URControl"
    body = bytes([len(name)]) + name + struct.pack(">BBii", major, minor, bugfix, build) + date.encode()
    return _packet(_VERSION, _CONTROLLER, body, time_ns)


def report_message(report: Report, time_ns: int) -> bytes:
    """Return a report as the packet that carries it."""
    match report:
        case TextReport():
            return _packet(_TEXT, _INTERPRETER, report.text.encode(), time_ns)
        case KeyReport():
            title = report.title.encode()
            body = struct.pack(">iiB", 0, 0, len(title)) + title + report.text.encode()
            return _packet(_KEY, _INTERPRETER, body, time_ns)
        case ProgramError():
            body = struct.pack(">ii", report.line, report.column) + report.text.encode()
            return _packet(_RUNTIME_EXCEPTION, _INTERPRETER, body, time_ns)
        case ErrorCode():
            body = struct.pack(">iiiII", report.code, report.argument, report.level, 0, 0) + report.text.encode()
            return _packet(_ERROR_CODE, _CONTROLLER, body, time_ns)
        case SafetyModeReport():
            return _packet(_SAFETY_MODE, _CONTROLLER, struct.pack(">iiBII", 0, 0, report.mode, 0, 0), time_ns)


def _packet(kind: int, source: int, body: bytes, time_ns: int) -> bytes:
    return _HEADER.pack(_HEADER.size + len(body), _ROBOT_MESSAGE, time_ns, source, kind) + body
