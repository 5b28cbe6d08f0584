"""The package alone and the wheel with the program ask for the same."""

from pathlib import Path

import tomlkit

import starlings

ROOT = Path(__file__).resolve().parents[3]


def project(file):
    return tomlkit.parse((ROOT / file).read_text(encoding="utf-8"))["project"]


def test_both_projects_have_the_same_name_version_and_requirements():
    alone, whole = project("sdk/python/pyproject.toml"), project("pyproject.toml")
    for key in ("name", "version", "requires-python", "license", "dependencies", "optional-dependencies"):
        assert alone[key] == whole[key], key
    assert alone["version"] == starlings.__version__


def test_the_program_has_the_same_version():
    cargo = tomlkit.parse((ROOT / "Cargo.toml").read_text(encoding="utf-8"))
    assert cargo["workspace"]["package"]["version"] == starlings.__version__
