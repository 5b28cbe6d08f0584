import sys
import textwrap
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent))

from served import Process  # noqa: E402


@pytest.fixture
def serve(tmp_path):
    """Starts a solver from its source; ends it after the test."""
    started = []

    def start(source, environment=None):
        script = tmp_path / "some_solver.py"
        script.write_text(textwrap.dedent(source))
        process = Process(script, tmp_path, environment)
        started.append(process)
        return process

    yield start
    for process in started:
        if process.child.poll() is None:
            process.child.kill()
            process.child.wait()
