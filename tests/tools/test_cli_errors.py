"""What the program says and returns when something is wrong, in this process with made-up commands."""

import argparse
import importlib
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from robot_io import errors
from tests.forked_push import forked
from tools import cli

ROOT = Path(__file__).resolve().parents[2]
PUSH = [sys.executable, "-c", "from robot_io._entry import main; raise SystemExit(main())"]

FAKE = """
from robot_io.errors import *
def add_arguments(parser):
    parser.add_argument("what")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--wrench")
def run(args):
    if args.what == "zero":
        return 0
    if args.what == "noise":
        for _ in range(100000):
            print("x" * 100)
        return 0
    if args.what == "inner-pipe":
        raise BrokenPipeError("a device's socket")
    if args.what == "interrupt":
        raise KeyboardInterrupt
    if args.what == "defect":
        raise ZeroDivisionError("division\\nby zero")
    raise globals()[args.what]("it failed", where="here", do="Do this")
"""


@pytest.fixture
def fake(tmp_path, monkeypatch):
    (tmp_path / "fake_push_command.py").write_text(FAKE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    monkeypatch.setitem(
        cli.COMMANDS, "fake", cli.Command("fake_push_command", "a test", ("push fake a", "push fake b"))
    )
    return tmp_path


def push(*argv, **kwargs):
    return subprocess.run([*PUSH, *argv], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False, **kwargs)


ERROR_CLASSES = [
    kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, errors.PushError)
]


@pytest.mark.parametrize("kind", ERROR_CLASSES, ids=lambda kind: kind.__name__)
def test_each_error_is_one_sentence_and_its_code(kind, fake, capsys):
    assert cli.main(["fake", kind.__name__]) == kind.exit_code
    out, err = capsys.readouterr()
    assert (out, err) == ("", "push: here: it failed. Do this\n")


def test_codes_are_the_documented_ones():
    codes = {kind.__name__: kind.exit_code for kind in ERROR_CLASSES}
    assert codes == {
        "PushError": 1,
        "UsageError": 2,
        "ConfigError": 2,
        "EnvironmentFault": 3,
        "DeviceError": 4,
        "DeviceUnreachable": 4,
        "DeviceProtocolError": 4,
        "DeviceNotReady": 4,
        "SafetyStop": 5,
        "ContactLost": 6,
        "NotDone": 9,
        "ReplayDiffers": 7,
        "LogDamaged": 8,
        "OperatorStop": 130,
    }


@pytest.mark.parametrize(
    ("argv", "code", "what"),
    [
        (["fake", "SafetyStop", "--json"], 5, "it failed"),
        (["fake", "interrupt", "--json"], 130, "stopped by the operator"),
        (["fake", "--json"], 2, "the following arguments are required: what"),
        (["fake", "zero", "--nope", "--json"], 2, "unrecognized arguments: --nope"),
        (["nonsense", "--json"], 2, "there is no command `nonsense`"),
        (["--nope", "--json"], 2, "`--nope` is not an option of push"),
        (["bench", "--json"], 2, None),
    ],
)
def test_json_errors_are_exactly_one_line(argv, code, what, fake, capsys):
    assert cli.main(argv) == code
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    answer = json.loads(out)
    assert answer["schema"] == 1
    assert set(answer["error"]) == {"code", "what", "where", "do"}
    assert answer["error"]["code"] == code
    assert what is None or answer["error"]["what"] == what


def test_defect_writes_its_traceback_and_says_where(fake, capsys):
    assert cli.main(["fake", "defect", "--json"]) == 1
    out, err = capsys.readouterr()
    assert "Traceback" not in err
    assert "unexpected ZeroDivisionError: division by zero" in err
    [trace] = fake.glob("push-error-*.txt")
    assert str(trace) in err
    assert "fake_push_command.py" in trace.read_text(encoding="utf-8")
    assert json.loads(out)["error"]["code"] == 1


def test_broken_pipe_of_a_device_is_not_taken_for_a_closed_stdout(fake, capsys):
    assert cli.main(["fake", "inner-pipe"]) == 1
    assert "unexpected BrokenPipeError" in capsys.readouterr().err


def test_values_with_minus_and_near_misses(fake, capsys):
    assert cli.main(["fake", "zero", "--wrench=-1,2"]) == 0
    assert cli.main(["rn"]) == 2
    assert "`push run`" in capsys.readouterr().err


def helps():
    """Return every command, and every action of those that have some, by its words."""
    words = list(cli.COMMANDS)
    for name, command in cli.COMMANDS.items():
        parser = cli.parser_of(name, importlib.import_module(command.module))
        for action in parser._actions:
            if isinstance(action, argparse._SubParsersAction):
                words += [f"{name} {word}" for word in action.choices]
    return words


def examples_of(words, capsys):
    """Return the examples that `push WORDS --help` shows."""
    with pytest.raises(SystemExit) as done:
        cli.main([*words.split(), "--help"])
    assert done.value.code == 0
    shown = capsys.readouterr().out
    assert shown.startswith(f"usage: push {words}")
    return [line.strip() for line in shown.split("examples:\n")[1].splitlines()]


@pytest.mark.parametrize("words", helps())
def test_every_help_has_two_examples_that_parse(words, capsys):
    shown = examples_of(words, capsys)
    assert len(set(shown)) == 2
    name = max((name for name in cli.COMMANDS if f"{words} ".startswith(f"{name} ")), key=len)
    parser = cli.parser_of(name, importlib.import_module(cli.COMMANDS[name].module))
    for example in shown:
        argv = shlex.split(example.split(" | ")[0])
        assert argv[: 1 + len(words.split())] == ["push", *words.split()]
        parser.parse_args(argv[1 + len(name.split()) :])


def test_no_examples_are_left_of_an_action_that_is_gone():
    assert set(cli.ACTIONS) <= set(helps())


def test_the_overview_loads_nothing_that_takes_long():
    code = "import sys; from robot_io._entry import main; main(); print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code, "--help"], cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = set(done.stderr.split())
    assert not loaded & {"msgspec", "numpy", "serial", "mcap", "inspect", "tempfile", "traceback", "asyncio"}


def test_overview_lists_the_commands(capsys):
    assert cli.main([]) == 0
    shown = capsys.readouterr().out
    assert all(f"  {name} " in shown for name in cli.COMMANDS)


def test_config_show_json_is_one_object_on_one_line():
    done = push("config", "show", "sim", "--set", "path.direction_deg=-30", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("\n") == 1
    answer = json.loads(done.stdout)
    assert answer["schema"] == 1
    assert answer["rig"]["path"]["direction_deg"] == -30.0
    assert answer["rig"]["ft"]["level"] == "sim"


def test_config_show_prints_a_rig_that_can_be_used_again(tmp_path, state):
    done = push("config", "show", "barrel")
    copy = tmp_path / "copy.toml"
    copy.write_text(done.stdout, encoding="utf-8")
    assert forked(state, "config", "show", str(copy)).out == done.stdout
    assert forked(state, "config", "check", str(copy)).code == 0


def test_config_check_of_a_bad_rig(tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text('extends = "emulated"\n[control]\nk_g = 1\n', encoding="utf-8")
    done = push("config", "check", str(bad), "--json")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert json.loads(done.stdout)["error"]["where"] == f"{bad}:3"


def test_reader_that_goes_away_is_no_error(fake):
    # The made-up command is not known to a fresh process, so it is added there.
    code = (
        "import sys; sys.path.insert(0, sys.argv.pop(1))\n"
        "from tools import cli\n"
        "cli.COMMANDS['fake'] = cli.Command('fake_push_command', 'a test', ('', ''))\n"
        "raise SystemExit(cli.main(sys.argv[1:]))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(fake), "fake", "noise"],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as child:  # fmt: skip
        assert child.stdout.readline().startswith("xxx")
        child.stdout.close()
        assert child.stderr.read() == ""
        assert child.wait(timeout=30) == cli.BROKEN_PIPE


@pytest.mark.parametrize("words", [["config", "show", "sim"], ["config", "check", "sim", "--json"]])
def test_output_to_a_full_disk_is_one_sentence(words):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*PUSH, *words], cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, timeout=30, check=False
        )
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1] == "push: there is no space left on the disk"
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "argv",
    [
        ["config", "check", "{}.toml"],
        ["run", "sim", "--fast", "--out", "{}"],
        ["replay", "{}"],
        ["report", "{}"],
        ["log", "info", "{}"],
    ],
    ids=lambda argv: argv[0],
)
def test_a_path_that_the_system_refuses_is_no_defect(argv, capsys):
    """As for a folder of another user's, which cannot be tried as root: even to ask whether it is there fails."""
    refused = "x" * 300
    assert cli.main([word.format(refused) for word in argv]) == 2
    assert "File name too long" in capsys.readouterr().err


@pytest.mark.parametrize("gone", ["a closed pipe", "a full disk"])
def test_an_error_that_nobody_reads_keeps_its_code(gone):
    if gone == "a closed pipe":
        read_fd, stdout = os.pipe()
        os.close(read_fd)
    else:
        stdout = os.open("/dev/full", os.O_WRONLY)
    done = subprocess.run(
        [*PUSH, "config", "check", "emulatd", "--json"],
        cwd=ROOT, timeout=60, check=False, stdout=stdout, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    os.close(stdout)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1


def test_closed_descriptors_are_filled_before_anything_opens():
    code = (
        "import os\nfor fd in (0, 1, 2): os.close(fd)\n"
        "from tools.cli import keep_standard_descriptors\nkeep_standard_descriptors()\n"
        "fd = os.open('/dev/null', os.O_RDONLY)\nos._exit(fd)"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, timeout=30, check=False).returncode >= 3


@pytest.mark.parametrize("closed", [0, 1, 2])
def test_runs_with_a_closed_standard_descriptor(closed):
    done = subprocess.run(
        [*PUSH, "config", "check", "emulated", "--json"],
        cwd=ROOT, timeout=60, check=False, capture_output=True, text=True, preexec_fn=lambda: os.close(closed),
    )  # fmt: skip
    assert done.returncode == 0
    if closed != 1:
        assert json.loads(done.stdout) == {"schema": 1, "name": "emulated", "good": True}
