"""One record between two processes: the newest wins, and none is ever torn."""

import os
import subprocess
import sys
import time

import pytest

from robot_io.ipc.record import SLOTS, SharedRecord
from tests.how_many import mostly_long

WRITER = """
import select, sys
from robot_io.ipc.record import SharedRecord
record = SharedRecord(int(sys.argv[1]), int(sys.argv[2]))
n = 0
while not select.select([sys.stdin], [], [], 0)[0]:
    for _ in range(200):
        n += 1
        record.publish(n.to_bytes(8, "little") * (record.payload_size // 8))
print(n)
"""
"""Writes as fast as it can until its standard input ends."""


@pytest.fixture
def record():
    made = SharedRecord.create("test-record", 24)
    yield made
    made.close()


def test_nothing_before_the_first(record):
    assert record.read() is None
    assert record.count == 0


def test_the_newest_wins_with_its_number(record):
    for n in range(1, 3 * SLOTS):
        record.publish(bytes([n]) * 24)
        assert record.read() == (n, bytes([n]) * 24)
        assert record.read() == (n, bytes([n]) * 24)
        assert record.count == n


def test_a_second_view_of_the_same_memory_sees_it(record):
    other = SharedRecord(os.dup(record.fd), 24)
    record.publish(b"a" * 24)
    assert other.read() == (1, b"a" * 24)
    other.close()
    record.publish(b"b" * 24)
    assert record.read() == (2, b"b" * 24)


@pytest.mark.parametrize("size", [0, 23, 25])
def test_another_size_is_refused(record, size):
    with pytest.raises(ValueError, match="24"):
        record.publish(b"x" * size)
    assert record.read() is None


def test_the_descriptor_is_not_inherited_by_accident_and_closing_twice_is_fine(record):
    assert not os.get_inheritable(record.fd)
    record.close()
    record.close()
    assert record.fd == -1


def test_a_reader_passed_by_the_writer_tries_again(record):
    """A head that moved on by 7 while the slot was copied: the copy may be torn and is thrown away."""
    record.publish(b"a" * 24)

    class Overtaken:
        """A view of the memory during whose first copy the writer publishes `count` more."""

        def __init__(self, view, count):
            self.view, self.count, self.copies = view, count, 0

        def __getitem__(self, key):
            found = bytes(self.view[key])
            self.copies += 1
            for n in range(self.count if self.copies == 1 else 0):
                record_publish(bytes([n]) * 24)
            return found

        def __setitem__(self, key, value):
            self.view[key] = value

        def release(self):
            self.view.release()

    record_publish = record.publish
    view = record._bytes
    for overtaking, copies in ((SLOTS - 2, 1), (SLOTS - 1, 2)):
        record._bytes = Overtaken(view, overtaking)
        count, payload = record.read()
        assert record._bytes.copies == copies
        if copies == 2:
            assert (count, payload) == (record.count, bytes([overtaking - 1]) * 24)
    record._bytes = view


def hammered(payload_size: int, enough: int) -> None:
    """Read while another process writes as fast as it can, until `enough` different records were seen."""
    record = SharedRecord.create("test-hammer", payload_size)
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(record.fd), str(payload_size)],
        pass_fds=(record.fd,), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        seen = last = 0
        deadline = time.monotonic() + 150.0
        while seen < enough:
            assert time.monotonic() < deadline, f"only {seen} records in 150 s"
            found = record.read()
            if found is None:
                continue
            count, payload = found
            assert payload == count.to_bytes(8, "little") * (payload_size // 8), "torn"
            assert count >= last
            seen += count != last
            last = count
        written = int(writer.communicate(timeout=20.0)[0])
        assert writer.returncode == 0
        assert record.read()[0] == record.count == written
    finally:
        writer.kill()
        writer.wait()
        record.close()


@pytest.mark.parametrize("payload_size", mostly_long((8, 304, 4096), 304))
def test_two_processes_and_no_torn_record(payload_size):
    hammered(payload_size, 20_000)


@pytest.mark.long
@pytest.mark.timeout(200)
def test_two_processes_and_no_torn_record_for_longer():
    hammered(304, 1_000_000)
