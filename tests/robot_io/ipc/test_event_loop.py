"""The epoll loop: order of timers, the grid, removal in the middle of things, and the ends of descriptors."""

import os
import select
import socket

import pytest

from robot_io.clock import monotonic_ns
from robot_io.ipc.event_loop import HANGUP, READ, WRITE, EventLoop, TimerFd

MS = 1_000_000


@pytest.fixture
def loop():
    made = EventLoop()
    yield made
    made.close()


@pytest.fixture
def pair():
    left, right = socket.socketpair()
    left.setblocking(False)
    right.setblocking(False)
    yield left, right
    left.close()
    right.close()


def run_until(loop, done, most_s=5.0):
    deadline = monotonic_ns() + round(most_s * 1e9)
    while not done():
        assert monotonic_ns() < deadline, "nothing happened"
        loop.run_once(100)


def test_timers_fire_in_the_order_of_their_deadlines_and_never_early(loop):
    base, fired = monotonic_ns() + 5 * MS, []
    for k in (3, 1, 2, 0, 1):
        loop.call_at(base + k * MS, lambda deadline: fired.append((deadline, monotonic_ns())))
    run_until(loop, lambda: len(fired) == 5)
    assert [(deadline - base) // MS for deadline, _ in fired] == [0, 1, 1, 2, 3]
    assert all(now >= deadline for deadline, now in fired)


def test_equal_deadlines_fire_in_the_order_they_were_asked(loop):
    at, fired = monotonic_ns() + 2 * MS, []
    for name in "abcdef":
        loop.call_at(at, lambda _, name=name: fired.append(name))
    run_until(loop, lambda: len(fired) == 6)
    assert fired == list("abcdef")


@pytest.mark.parametrize("deadline_ns", [0, 1, 12345])
def test_a_deadline_long_past_fires_at_once(loop, deadline_ns):
    fired = []
    loop.call_at(deadline_ns, fired.append)
    run_until(loop, lambda: fired)
    assert fired == [deadline_ns]


def test_a_timer_keeps_its_grid_and_owes_what_it_missed(loop):
    first, fired = monotonic_ns() - 25 * MS, []
    timer = loop.call_every(10 * MS, fired.append, first)
    loop.run_once(100)
    assert fired[:3] == [first, first + 10 * MS, first + 20 * MS]  # one after another
    run_until(loop, lambda: len(fired) >= 6)
    assert fired == [first + k * 10 * MS for k in range(len(fired))]
    timer.cancel()
    timer.cancel()
    count = len(fired)
    loop.run_once(15)
    loop.run_once(15)
    assert len(fired) == count


def test_without_a_first_time_a_timer_begins_one_period_from_now(loop):
    fired, before = [], monotonic_ns()
    loop.call_every(3 * MS, fired.append)
    run_until(loop, lambda: fired)
    assert fired[0] >= before + 3 * MS


def test_a_cancelled_timer_never_fires_not_even_in_the_round_it_is_due(loop):
    at, fired = monotonic_ns() - MS, []
    later = loop.call_at(at + 10, lambda _: fired.append("later"))

    def first(_):
        fired.append("first")
        later.cancel()

    loop.call_at(at, first)
    loop.run_once(100)
    loop.run_once(5)
    assert fired == ["first"]


def test_a_timer_added_by_a_callback_fires_too_even_an_earlier_one(loop):
    fired, now = [], monotonic_ns()
    loop.call_at(now + 10_000 * MS, fired.append)

    def sooner(_):
        loop.call_at(now + 2 * MS, fired.append)

    loop.call_at(now, sooner)
    run_until(loop, lambda: fired)
    assert fired == [now + 2 * MS]


def test_a_timer_may_cancel_itself(loop):
    fired = []

    def once(deadline):
        fired.append(deadline)
        timer.cancel()

    timer = loop.call_every(MS, once, monotonic_ns() - 10 * MS)
    loop.run_once(100)
    loop.run_once(5)
    assert len(fired) == 1


def test_a_descriptor_calls_when_there_is_something(loop, pair):
    left, right = pair
    got = []
    loop.add_fd(left.fileno(), lambda events: got.append((events, left.recv(100))))
    loop.run_once(1)
    assert got == []
    right.send(b"hello")
    run_until(loop, lambda: got)
    assert got == [(READ, b"hello")]


def test_a_descriptor_is_told_again_until_it_is_read(loop, pair):
    left, right = pair
    calls = []
    loop.add_fd(left.fileno(), calls.append)
    right.send(b"x")
    for _ in range(3):
        loop.run_once(100)
    assert len(calls) == 3


def test_what_is_waited_for_can_change(loop, pair):
    left, _ = pair
    calls = []
    loop.add_fd(left.fileno(), calls.append)
    loop.run_once(1)
    assert calls == []
    loop.set_events(left.fileno(), READ | WRITE)
    run_until(loop, lambda: calls)
    assert calls[0] & WRITE


def test_a_hang_up_is_told(loop):
    read_fd, write_fd = os.pipe()
    calls = []
    loop.add_fd(read_fd, calls.append)
    os.close(write_fd)
    run_until(loop, lambda: calls)
    assert calls[0] & HANGUP
    loop.remove_fd(read_fd)
    loop.run_once(1)
    assert len(calls) == 1
    os.close(read_fd)


def test_a_descriptor_removed_by_another_of_the_same_round_is_not_called(loop):
    """Both are ready; whoever comes first removes the other."""
    pipes = [os.pipe() for _ in range(2)]
    calls = []

    def handler(mine, other):
        def on_ready(_):
            calls.append(mine)
            loop.remove_fd(other)

        return on_ready

    (a, _), (b, _) = pipes
    loop.add_fd(a, handler(a, b))
    loop.add_fd(b, handler(b, a))
    for _, write_fd in pipes:
        os.write(write_fd, b"x")
    loop.run_once(100)
    assert len(calls) == 1
    loop.run_once(10)
    assert set(calls) == {calls[0]}
    for ends in pipes:
        for fd in ends:
            os.close(fd)


def test_removing_an_unknown_descriptor_is_nothing(loop, pair):
    loop.remove_fd(pair[0].fileno())
    loop.add_fd(pair[0].fileno(), lambda _: None)
    loop.remove_fd(pair[0].fileno())
    loop.remove_fd(pair[0].fileno())
    loop.add_fd(pair[0].fileno(), lambda _: None)  # and it can come back


def test_run_ends_after_stop(loop):
    fired = []

    def stop(deadline):
        fired.append(deadline)
        loop.stop()

    loop.call_every(MS, stop, monotonic_ns())
    loop.run()
    assert fired
    count = len(fired)
    loop.run()  # and can run again
    assert len(fired) > count


def test_an_error_of_a_callback_comes_out_and_the_loop_goes_on(loop):
    fired = []

    def broken(_):
        raise RuntimeError("broken")

    loop.call_at(1, broken)
    loop.call_at(2, fired.append)
    with pytest.raises(RuntimeError, match="broken"):
        run_until(loop, lambda: fired)
    run_until(loop, lambda: fired)
    assert fired == [2]


def test_closing_twice_is_fine_and_leaves_the_users_descriptors_open(pair):
    loop = EventLoop()
    loop.add_fd(pair[0].fileno(), lambda _: None)
    loop.close()
    loop.close()
    assert pair[0].fileno() >= 0
    pair[1].send(b"x")
    assert pair[0].recv(1) == b"x"


def test_a_timer_descriptor_by_itself():
    timer = TimerFd()
    poll = select.poll()
    poll.register(timer.fileno(), select.POLLIN)
    timer.set_ns(monotonic_ns() + MS)
    assert poll.poll(2000)
    timer.set_ns(monotonic_ns() + 3_600_000 * MS)
    assert not poll.poll(0), "setting it again takes its expiration back"
    timer.set_ns(monotonic_ns() + MS)
    assert poll.poll(2000)
    timer.set_ns(0)
    assert not poll.poll(5)
    with pytest.raises(OSError, match="timerfd_settime"):
        timer.set_ns(-1)
    poll.unregister(timer.fileno())
    timer.close()
    timer.close()
