"""Run jobs in worker processes, each with its own copy of the tree."""

from __future__ import annotations

import ctypes
import os
import pickle
import select
import signal
import socket
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, TypeVar, cast

from tools.dev.mutants.trial import session
from tools.dev.mutants.trial.tree import Tree

Job = TypeVar("Job")
Answer = TypeVar("Answer")
_PDEATHSIG = 1
"""PR_SET_PDEATHSIG of prctl(2)."""


def run_jobs(jobs: Sequence[Job], handle: Callable[[Tree, Job], Answer], workers: int) -> Iterator[tuple[Job, Answer]]:
    """Yield each job with its answer as it arrives; `handle` runs in a worker.

    Raises RuntimeError if a worker dies. Closing the iterator ends the workers and removes their trees.
    """
    waiting = iter(range(len(jobs)))
    with tempfile.TemporaryDirectory(prefix="mutants-", ignore_cleanup_errors=True) as folder:
        links: dict[socket.socket, tuple[int, BinaryIO]] = {}
        busy: set[socket.socket] = set()
        try:
            for number in range(min(workers, len(jobs))):
                link, pid = _start(Path(folder) / str(number), jobs, handle, links)
                links[link] = pid, cast(BinaryIO, link.makefile("rb"))
                link.sendall(next(waiting).to_bytes(4))
                busy.add(link)
            while busy:
                for link in select.select(list(busy), [], [])[0]:
                    try:
                        index, answer = pickle.load(links[link][1])
                    except EOFError:
                        raise RuntimeError(f"a worker died during a job (process {links[link][0]})") from None
                    following = next(waiting, None)
                    if following is None:
                        busy.remove(link)
                    else:
                        link.sendall(following.to_bytes(4))
                    yield jobs[index], answer
        finally:
            for link, (pid, stream) in links.items():
                stream.close()
                link.close()
                if link in busy:
                    os.kill(pid, signal.SIGINT)
                os.waitpid(pid, 0)


def _start(
    root: Path,
    jobs: Sequence[Job],
    handle: Callable[[Tree, Job], Answer],
    others: dict[socket.socket, tuple[int, BinaryIO]],
) -> tuple[socket.socket, int]:
    ours, theirs = socket.socketpair()
    parent = os.getpid()
    pid = os.fork()
    if pid:
        theirs.close()
        return ours, pid
    code = 1
    try:
        # A worker that held another's end open would keep it from noticing that ours closed. A socket stays open as
        # long as a stream made of it does.
        for _, stream in others.values():
            stream.close()
        for link in (ours, *others):
            link.close()
        ctypes.CDLL(None).prctl(_PDEATHSIG, signal.SIGINT, 0, 0, 0)
        if os.getppid() == parent:
            _serve(theirs, Tree.copy(root), jobs, handle)
        code = 0
    except KeyboardInterrupt:
        code = 130
    finally:
        os._exit(code)


def _serve(link: socket.socket, tree: Tree, jobs: Sequence[Job], handle: Callable[[Tree, Job], Answer]) -> None:
    session.prepare()
    while request := link.recv(4):
        index = int.from_bytes(request)
        link.sendall(pickle.dumps((index, handle(tree, jobs[index]))))
