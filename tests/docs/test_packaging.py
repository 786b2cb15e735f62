"""The distribution contains every package, and the lock files name no package index."""

from __future__ import annotations

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_every_package_is_in_the_wheel() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    build = project["tool"]["hatch"]["build"]
    packages = {str(p.parent.relative_to(ROOT)) for p in ROOT.glob("s*/**/shift_*/__init__.py")}
    assert set(build["targets"]["wheel"]["packages"]) == packages
    assert set(build["dev-mode-dirs"]) == {str(Path(p).parent) for p in packages}
    assert set(project["tool"]["importlinter"]["root_packages"]) == {Path(p).name for p in packages}


def test_the_lock_files_name_no_index() -> None:
    for lock in ROOT.glob("requirements*.lock"):
        assert "://" not in lock.read_text(encoding="utf-8"), lock.name
