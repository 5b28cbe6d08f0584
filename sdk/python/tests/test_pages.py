"""The blocks of docs/python.md run as they stand, one after the other, in a copy of nothing but what they name."""

import re
import shutil
from pathlib import Path

import pytest
from test_commands import EXAMPLES, pytestmark  # noqa: F401

PAGE = EXAMPLES.parent / "docs" / "python.md"
BLOCK = re.compile(r"^```python(?P<needs> \w+)?\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_blocks_of_the_page_run(tmp_path, monkeypatch, capsys):
    shutil.copytree(EXAMPLES / "oscillator", tmp_path / "examples" / "oscillator")
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    blocks = list(BLOCK.finditer(PAGE.read_text(encoding="utf-8")))
    assert len(blocks) == 4
    for block in blocks:
        needs = (block["needs"] or "").strip()
        if needs:
            pytest.importorskip(needs)
        exec(compile(block["code"], str(PAGE), "exec"), names)
    said = capsys.readouterr().out
    assert "crossed with probability 1.000" in said
    assert abs(names["again"]["k"]["estimate"] - 40.0) < 0.2
