"""Where results go and the program is, and what is said where they cannot be there."""

from pathlib import Path

import pytest
from test_commands import EXAMPLES, cooling_study, pytestmark  # noqa: F401

import starlings


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder in which nobody can write")
@pytest.mark.parametrize("command", ["run", "explain", "infer", "diagnose"])
def test_a_current_folder_that_cannot_be_written_to_is_told_with_out(command, monkeypatch):
    monkeypatch.chdir("/proc")
    for study in (EXAMPLES / "oscillator" / "study.toml", cooling_study()):
        with pytest.raises(starlings.StudyError, match=r"runs in the current folder, .* cannot be written to \(.*\): name another place with out="):
            getattr(starlings, command)(study)


def test_a_folder_that_cannot_be_made_is_told_with_out(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(starlings.StudyError, match=r"file/out cannot be written to \(Not a directory\): name another one with out="):
        starlings.run(cooling_study(), out=tmp_path / "file" / "out")


def test_without_the_program_the_remedy_is_said(monkeypatch, tmp_path):
    monkeypatch.delenv("STARLINGS_PROGRAM", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("sysconfig.get_path", lambda name: str(tmp_path))
    with pytest.raises(starlings.RunError, match="installed without it"):
        starlings.check("study.toml")
