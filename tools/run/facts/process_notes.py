"""What the processes of a run other than control leave to say, in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from robot_io.ipc.spawn import Child


def process_notes(children: Mapping[str, Child]) -> list[str]:
    """Return what went wrong in them, once all have ended."""
    notes = []
    for name in ("gate", "emulators", "arm", "recorder", "live"):
        child = children.get(name)
        if child is not None and child.errors:
            notes.append(f"{name}: {child.errors[-1].what}")
        elif child is not None and child.process.returncode != 0:
            notes.append(f"the {name} process {child.how_it_ended()}")
    recorded = children["recorder"].finished or {}
    if not recorded.get("complete", False):
        notes.append("the log is not complete: `push log recover` may repair it")
    if dropped := sum(recorded.get("dropped", {}).values()):
        notes.append(f"{dropped} records did not fit into the log's ring buffers")
    if unseen := (recorded.get("live") or {}).get("dropped", 0):
        notes.append(f"the live view missed {unseen} messages; the log has them")
    return notes


def warn_without_realtime(children: Mapping[str, Child], say: Callable[[str], None]) -> None:
    """Name those without real-time priority, if there are any."""
    plain = [name for name, child in children.items() if (child.ready or {}).get("realtime") is False]
    if plain:
        say(f"no permission for real-time priority for {', '.join(plain)}: only 100 Hz is supported")
