"""Worker processes of the mutation tool: every job is answered, and all of them end."""

import subprocess
import sys

import pytest

PROGRAM = """
from tools.dev.mutants.trial.pool import run_jobs
print(sorted(run_jobs(list(range(7)), lambda tree, job: job * job, 3)))
"""


@pytest.mark.long
def test_every_job_is_answered_and_all_workers_end():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str([(n, n * n) for n in range(7)])
