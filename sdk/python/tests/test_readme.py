"""The quick start of the README is ten lines of code, and they come to a posterior."""

import re

from test_commands import EXAMPLES, pytestmark  # noqa: F401

README = EXAMPLES.parent / "README.md"


def test_the_quick_start_runs(tmp_path, monkeypatch):
    text = README.read_text(encoding="utf-8").split("## From Python\n", 1)[1]
    code = re.search(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)[1]
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    exec(compile(code, str(README), "exec"), names)
    for name, truth in (("start", 70.0), ("rate", 0.05)):
        entry = names["run"][name]
        assert abs(entry["estimate"] - truth) < 4.0 * entry["sd"]
