"""Create the `.venv` of this checkout: `python3 tools/bootstrap.py runtime|dev`, called by every make target.

It uses only the standard library, and no syntax newer than Python 3.7, so that an old Python prints an
explanation instead of a syntax error. It works where the system's pip is externally managed, and with only
python3-venv or only python3-pip present. A stamp in `.venv` records what was installed from which files, so that
nothing is done twice.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
EXTRAS = {"runtime": "[app]", "dev": "[dev,sweep,cluster]"}
OLDEST = (3, 11)
WHEELS_BELOW = (3, 13)
"""ur_rtde has wheels for Python versions below this one; for newer ones it is compiled."""
APT_VENV = "sudo apt install python3-venv"
NO_WHEEL = (
    "ur_rtde has wheels for Python 3.11 and 3.12: `make PYTHON=python3.12 demo`; "
    "to compile it instead: `sudo apt install git cmake g++ libboost-all-dev python3-dev`"
)


UNFINISHED = ".unfinished"
"""Marks an environment that is being created or filled. One that still has it was interrupted and is recreated: a
partly installed package looks installed."""


class SetUpError(Exception):
    """Set-up cannot continue; the text says what to do."""


def run(*command: str, quiet: bool = True) -> bool:
    """Run `command`; return whether it succeeded. `quiet` is for commands that may fail on some machines."""
    sink = subprocess.DEVNULL if quiet else None
    try:
        done = subprocess.run(command, stdout=sink, stderr=sink, stdin=subprocess.DEVNULL, check=False)
    except OSError:  # no such program
        return False
    return done.returncode == 0


def digest_of_inputs() -> str:
    """Return a digest of the two files that define what to install."""
    digest = hashlib.sha256()
    for name in ("pyproject.toml", "constraints.txt"):
        digest.update((ROOT / name).read_bytes())
    return digest.hexdigest()


def choose_python() -> str:
    """Return the interpreter to use: this one, or an installed older one if this one is too new for the wheels.

    In an active environment, the one it was created from: `.venv` cannot be created from itself.
    """
    if sys.version_info[:2] < OLDEST:
        this = ".".join(map(str, sys.version_info[:2]))
        raise SetUpError(
            f"Python {OLDEST[0]}.{OLDEST[1]} or newer is needed and {sys.executable} is {this}: "
            "install a newer one and name it, for example `make PYTHON=python3.12 demo`"
        )
    if sys.version_info[:2] >= WHEELS_BELOW:
        for name in ("python3.12", "python3.11"):
            other = shutil.which(name)
            if other and run(other, "-c", "import venv"):
                return other
    return os.path.realpath(getattr(sys, "_base_executable", sys.executable))


def make_folder(venv: Path) -> None:
    """Create the folder `venv`, replacing any existing one, and mark it as unfinished."""
    shutil.rmtree(venv, ignore_errors=True)
    venv.mkdir()
    (venv / UNFINISHED).touch()


def make_venv(python: str, venv: Path) -> list[str]:
    """Create `venv` and return the pip command that installs into it. Raises SetUpError."""
    inside = [str(venv / "bin" / "python"), "-m", "pip"]
    if (venv / "bin" / "uv").exists() or run(*inside, "--version"):
        return inside  # it exists already
    make_folder(venv)
    if run(python, "-m", "venv", str(venv)) and run(*inside, "--version"):
        return inside
    # Without python3-venv the environment has no pip, but a system pip can install into another environment.
    make_folder(venv)
    outside = [python, "-m", "pip", "--python", str(venv / "bin" / "python")]
    if run(python, "-m", "venv", "--without-pip", str(venv)) and run(*outside, "--version"):
        return outside
    shutil.rmtree(venv, ignore_errors=True)
    raise SetUpError(f"this Python cannot create an environment with pip: run `{APT_VENV}`, then try again")


def install(kind: str, pip: list[str], venv: Path) -> None:
    """Install the program with the pinned versions, with uv if it is available, else with pip. Raises SetUpError."""
    uv = str(venv / "bin" / "uv")
    wanted = ["-c", str(ROOT / "constraints.txt"), "-e", f"{ROOT}{EXTRAS[kind]}"]
    if Path(uv).exists() or run(*pip, "install", "-q", "--disable-pip-version-check", "uv"):
        # Byte-compiled at once, as pip does: otherwise the first runs would compile matplotlib and numpy, or, where
        # PYTHONDONTWRITEBYTECODE is set, every process of every run.
        into = ["--compile-bytecode", "--python", str(venv / "bin" / "python")]
        if not run(uv, "pip", "list", *into[1:]):  # no place for its cache, as in a read-only home
            into.append("--no-cache")
        done = run(uv, "pip", "install", "-q", *into, *wanted, quiet=False)
    else:
        done = run(*pip, "install", "-q", "--disable-pip-version-check", *wanted, quiet=False)
    if not done:
        hint = f" {NO_WHEEL}" if sys.version_info[:2] >= WHEELS_BELOW else ""
        raise SetUpError(f"installing failed, for the reason above. Is a package index reachable?{hint}")


def set_up(kind: str, venv: Path) -> None:
    """Install what `kind` (runtime or dev) needs into `venv`; return at once if its stamp says it is there."""
    python = choose_python()
    digest = digest_of_inputs()
    home = f"{python} in {ROOT}"
    stamp = venv / ".installed"
    written = stamp.read_text(encoding="utf-8").splitlines() if stamp.is_file() else []
    installed, for_digest, at_home = (*written, "", "", "")[:3]
    # dev includes all of runtime
    if at_home == home and for_digest == digest and installed in ("dev", kind) and not (venv / UNFINISHED).exists():
        return
    print(f"setting up {venv.name} ({kind}) with {python}: about half a minute the first time", flush=True)
    # Another Python or a moved folder, whose scripts would not start; or an interrupted set-up.
    if at_home not in ("", home) or (venv / UNFINISHED).exists():
        make_folder(venv)
    pip = make_venv(python, venv)
    (venv / UNFINISHED).touch()
    stamp.unlink(missing_ok=True)
    # What `make test` installed stays installed if `make demo` follows a change.
    kind = "dev" if installed == "dev" else kind
    install(kind, pip, venv)
    stamp.write_text(f"{kind}\n{digest}\n{home}\n", encoding="utf-8")
    (venv / UNFINISHED).unlink()


def main() -> int:
    """Set up for `runtime` or `dev`; return 0, or 2 after printing what is wrong."""
    os.environ.pop("VIRTUAL_ENV", None)  # nothing is installed into the caller's active environment
    # One set-up at a time: two make calls in two terminals wait for each other.
    with (ROOT / "pyproject.toml").open("rb") as guard:
        fcntl.flock(guard, fcntl.LOCK_EX)
        try:
            set_up(sys.argv[1] if len(sys.argv) > 1 else "runtime", ROOT / ".venv")
        except SetUpError as error:
            print(f"set-up: {error}", file=sys.stderr)
            return 2
        except OSError as error:  # another user's checkout, a full disk
            print(f"set-up: {error.filename or ROOT} cannot be written: {error.strerror}", file=sys.stderr)
            return 2
        except KeyboardInterrupt:
            print("set-up: stopped; the next make continues", file=sys.stderr)
            return 130
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
