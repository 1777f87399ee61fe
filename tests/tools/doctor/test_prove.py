"""The proof that a base stops by itself: what is measured, and what is said of a base that does not."""

import time

import pytest

from robot_io.clock import monotonic_ns
from robot_io.messages import BaseOdometry, BodyTwist, DeviceHealth, DeviceInfo, LinkState, Stamped
from tools.doctor import prove
from tools.places import base_proof
from tools.rig import resolve_rig


class FakeBase:
    """Obeys at once, and stops `after_s` after the last command; tells its velocity every 20 ms."""

    before_close = None

    def __init__(self, after_s, follows=True):
        self.after_s, self.follows = after_s, follows
        self.sent_ns = self.newest_inbound_ns = self.newest_pong_ns = 0
        self.stops = 0
        self._told_ns = 0
        self._wanted = BodyTwist()

    def open(self):
        return DeviceInfo("base", "here")

    def start(self):
        pass

    def command(self, wanted):
        self.sent_ns, self._wanted = monotonic_ns(), wanted
        return wanted

    def drain(self):
        now_ns = monotonic_ns()
        if now_ns - self._told_ns < 20_000_000:
            return ()
        self._told_ns = now_ns
        moving = self.follows and now_ns - self.sent_ns < self.after_s * 1e9
        return (Stamped(BaseOdometry(self._wanted if moving else BodyTwist()), 0, now_ns),)

    def health(self):
        return DeviceHealth(LinkState.UP, "", {}, 0.0)

    def stop(self):
        self.stops += 1

    def close(self):
        pass


@pytest.fixture(autouse=True)
def _own_state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def rig():
    return resolve_rig("emulated", ["base.level=hardware", "base.url=ws://127.0.0.1:1"])


def proved(monkeypatch, rig, base):
    monkeypatch.setattr(prove, "build_driver", lambda *_, **__: base)
    return prove.prove_base_timeout(rig, "")


@pytest.mark.parametrize(
    ("after_s", "follows", "result", "word"),
    [
        (0.25, True, "ok", "stood"),
        pytest.param(0.6, True, "failed", "stood", marks=pytest.mark.long),
        (9.0, True, "failed", "still moving"),
        (0.25, False, "failed", "does not move"),
    ],
)
def test_a_base_that_does_not_stop_by_itself_is_found(monkeypatch, rig, after_s, follows, result, word):
    base = FakeBase(after_s, follows)
    row = proved(monkeypatch, rig, base)
    assert (row.check, row.result) == ("base.timeout", result), row
    assert word in row.evidence
    assert base.stops >= 1, "whatever was found, it ends with zeros"
    assert (base_proof.age_s(rig) is not None) is (result == "ok")


@pytest.mark.parametrize(("hours", "result"), [(0, "ok"), (23, "ok"), (25, "warning")])
def test_a_proof_is_good_for_a_day(monkeypatch, rig, hours, result):
    base_proof.save(rig, 0.3)
    later_s = time.time() + 3600.0 * hours
    monkeypatch.setattr(time, "time", lambda: later_s)
    assert prove.proof_row(rig).result == result


def test_a_proof_is_of_one_base(rig):
    assert prove.proof_row(rig).result == "warning"
    base_proof.save(rig, 0.3)
    other = resolve_rig("emulated", ["base.level=hardware", "base.url=ws://127.0.0.1:2"])
    assert prove.proof_row(other).result == "warning"
    assert "--prove-base-timeout" in prove.proof_row(other).fix
