"""Entry of the `push` program: makes sure that `control` and its other folders are ours before anything runs.

The program's folders are top-level packages, and python-control (a common library) is called `control` too. The
checkout therefore goes first on the path, here and in every child process; if a foreign module is in the
way all the same, one sentence says so and the exit code is 3.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

from robot_io.errors import EnvironmentFault, OperatorStop

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("control", "safety", "sim_backend", "tools")


def check_checkout() -> None:
    """Raise EnvironmentFault where robot_io was installed as a library, without the application around it."""
    if not (ROOT / "tools" / "cli.py").is_file():
        raise EnvironmentFault(
            "only the library `robot_io` is installed here, and `push` runs from a checkout of the project",
            where=str(ROOT),
            do="Clone the project and run `make demo` in it; the drivers work without it: `from robot_io import Ft300`",
        )


def put_root_first() -> None:
    """Put the checkout first on `sys.path`, and in PYTHONPATH for child processes."""
    root = str(ROOT)
    sys.path[:] = [root, *(entry for entry in sys.path if entry != root)]
    inherited = [entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if entry and entry != root]
    os.environ["PYTHONPATH"] = os.pathsep.join([root, *inherited])


def check_packages() -> None:
    """Raise EnvironmentFault naming the first of our packages that is someone else's."""
    for name in PACKAGES:
        try:
            spec = importlib.util.find_spec(name)
        except ValueError:  # already imported, and without a spec
            spec = None
        origin = spec.origin if spec is not None else None
        if origin is None or Path(origin).resolve() != ROOT / name / "__init__.py":
            raise EnvironmentFault(
                f"the Python package `{name}` found here is not this program's",
                where=origin or "sys.path",
                do=f"Run `push` from its own .venv, made by `make demo`, with nothing that imports `{name}` before it",
            )


def main() -> int:
    """Run the `push` program; return its exit code."""
    try:
        check_checkout()
        put_root_first()
        check_packages()
        from tools import cli  # after the checks: only then it is this program's, and not someone else's `tools`
    except (EnvironmentFault, KeyboardInterrupt) as ended:
        from robot_io.error_report import report

        error = ended if isinstance(ended, EnvironmentFault) else OperatorStop("stopped by the operator")
        return report(error, as_json="--json" in sys.argv)
    return cli.main(sys.argv[1:])
