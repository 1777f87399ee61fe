"""The gate's process with faults injected into its base: `python -m tools.run.injected_gate` (job on stdin).

The gate proper, which moves real robots, knows nothing of injection; only a run with faults of `base.*` starts this.
"""

from __future__ import annotations

import sys

from robot_io.clock import monotonic_ns
from robot_io.driver import Base
from robot_io.ipc.ring import Ring
from safety import gate_process
from safety.gate_process import GateJob
from sim_backend.injection.base import InjectedBase
from sim_backend.injection.event import event_writer
from sim_backend.injection.injection import Injection


class InjectedGateJob(GateJob, frozen=True):
    """The gate's job, and the faults to inject."""

    faults: tuple[str, ...] = ()


def injected(base: Base, job: InjectedGateJob) -> Base:
    """Return the base under the job's faults."""
    write = event_writer(Ring(job.ring_fd).push, job.wall_offset_ns)
    return InjectedBase(base, Injection(job.faults, monotonic_ns, write))


if __name__ == "__main__":
    sys.exit(gate_process.main(InjectedGateJob, injected))
