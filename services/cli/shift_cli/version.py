"""What ``shift-mesh --version`` says."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[3]
"""The repository, where this runs out of one."""
GIT_TIMEOUT_S = 5.0


def version_line() -> str:
    """Return the version, the git revision where it is known, and Python's version."""
    try:
        number = version("shift-mesh")
    except PackageNotFoundError:
        number = "of an unknown version"
    known = revision()
    git = f", git {known}" if known else ""
    return f"shift-mesh {number} (Python {platform.python_version()}{git})"


def revision() -> str:
    """Return ``SHIFT_REVISION``, else the commit of the checkout, with ``-dirty`` where files differ; else nothing."""
    if told := os.environ.get("SHIFT_REVISION"):
        return told
    if not (CHECKOUT / ".git").exists():
        return ""
    command = ["git", "-C", str(CHECKOUT), "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=GIT_TIMEOUT_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
