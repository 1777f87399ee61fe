"""JSON lines from a child: whole, in order, and never in the speaker's way."""

import os
import select
import time

import pytest

from robot_io.errors import DeviceUnreachable, EnvironmentFault, PushError
from robot_io.ipc.status import StatusPipe, StatusReader, error_of


@pytest.fixture
def ends():
    read_fd, write_fd = os.pipe()
    speaker, listener = StatusPipe(write_fd), StatusReader(read_fd)
    yield speaker, listener, write_fd
    listener.close()
    try:
        os.close(write_fd)
    except OSError:
        return


def test_lines_arrive_in_order(ends):
    speaker, listener, _ = ends
    assert listener.read() == []
    speaker.say("ready", port="/dev/pts/3", realtime=False)
    speaker.say("status", tick=7)
    assert listener.read() == [
        {"event": "ready", "port": "/dev/pts/3", "realtime": False},
        {"event": "status", "tick": 7},
    ]
    assert listener.read() == []
    assert listener.open


@pytest.mark.parametrize("kind", [DeviceUnreachable, EnvironmentFault, PushError])
def test_an_error_arrives_as_what_it_was(ends, kind):
    speaker, listener, _ = ends
    speaker.error(kind("it is off", where="ft300", do="Switch it on"))
    (event,) = listener.read()
    assert event["event"] == "error"
    error = error_of(event)
    assert type(error) is kind
    assert (error.what, error.where, error.do) == ("it is off", "ft300", "Switch it on")


@pytest.mark.parametrize(
    "event",
    [{}, {"kind": "DeviceError"}, {"kind": "annotations", "error": {}}, {"kind": 3, "error": {"what": 4}}],
)
def test_an_error_that_makes_no_sense_is_still_one(event):
    assert isinstance(error_of(event), PushError)


def test_a_full_pipe_does_not_block_and_the_rest_stays_readable(ends):
    speaker, listener, _ = ends
    for n in range(3000):
        speaker.say("status", n=n, text="x" * 100)
    got = [event["n"] for event in listener.read()]
    assert got == list(range(len(got)))
    assert 100 < len(got) < 3000
    speaker.say("finished", n=-1)
    assert listener.read() == [{"event": "finished", "n": -1}]


def test_a_long_line_cut_by_a_full_pipe_does_not_take_the_next_one_with_it(ends):
    """A line longer than PIPE_BUF may go in by half; only that one is lost."""
    speaker, listener, _ = ends
    speaker.say("status", text="a" * 60_000)
    speaker.say("status", text="b" * 30_000)  # does not fit any more
    assert [event["text"][0] for event in listener.read()] == ["a"]
    speaker.say("finished", exit_code=5)
    assert listener.read() == [{"event": "finished", "exit_code": 5}]


def test_the_last_word_waits_for_a_listener_that_was_held_up(ends):
    read_fd, write_fd = ends[1].fd, ends[2]
    speaker = StatusPipe(write_fd)
    while _fits(write_fd):
        speaker.say("status", text="x" * 500)
    pid = os.fork()
    if pid == 0:  # a listener that comes late: everything in the pipe and the whole last word, 200 KB, or code 1
        late = StatusReader(read_fd)
        time.sleep(0.2)
        deadline_s = time.monotonic() + 10.0
        while time.monotonic() < deadline_s:
            if any(event["event"] == "finished" and len(event["text"]) == 200_000 for event in late.read()):
                os._exit(0)
            time.sleep(0.01)
        os._exit(1)
    speaker.say_whole(10.0, "finished", text="y" * 200_000)
    assert os.waitpid(pid, 0)[1] == 0


def test_the_last_word_is_given_up_when_nobody_listens(ends):
    speaker, listener, _ = ends
    began_s = time.monotonic()
    speaker.say_whole(0.2, "finished", text="y" * 200_000)
    assert 0.2 <= time.monotonic() - began_s < 5.0
    assert listener.read() == []
    listener.close()
    speaker.say_whole(5.0, "finished")
    assert time.monotonic() - began_s < 5.0


def _fits(fd):
    poll = select.poll()
    poll.register(fd, select.POLLOUT)
    return bool(poll.poll(0))


def test_a_closed_pipe_is_no_error_for_the_speaker(ends):
    speaker, listener, _ = ends
    listener.close()
    listener.close()
    speaker.say("status")
    assert not listener.open
    assert listener.read() == []


def test_the_end_of_the_speaker_is_seen_after_its_last_line(ends):
    speaker, listener, write_fd = ends
    speaker.say("finished")
    os.close(write_fd)
    assert listener.read() == [{"event": "finished"}]
    assert not listener.open
    assert listener.read() == []


def test_a_line_in_pieces_and_lines_that_mean_nothing(ends):
    _, listener, write_fd = ends
    os.write(write_fd, b'{"event":"re')
    assert listener.read() == []
    os.write(write_fd, b'ady"}\nnot json\n[1,2]\n"text"\n\n{"event":"x"}\n{"event":"half"')
    assert listener.read() == [{"event": "ready"}, {"event": "x"}]
    os.close(write_fd)
    assert listener.read() == []


def test_a_descriptor_that_breaks_reads_as_the_end():
    read_fd, write_fd = os.pipe()
    listener = StatusReader(read_fd)
    os.close(read_fd)
    assert listener.read() == []
    assert not listener.open
    os.close(write_fd)
