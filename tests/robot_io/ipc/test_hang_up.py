"""A pipe without a writer tells its reader that a process has ended."""

import os

from robot_io.ipc.process import is_hung_up


def test_a_pipe_is_hung_up_when_its_last_writer_is_gone():
    reader, writer = os.pipe()
    another = os.dup(writer)
    assert not is_hung_up(reader)
    os.write(writer, b"x")
    assert not is_hung_up(reader)
    os.close(writer)
    assert not is_hung_up(reader)
    os.close(another)
    assert is_hung_up(reader)
    os.close(reader)


def test_no_pipe_is_never_hung_up():
    assert not is_hung_up(-1)
