"""Environments of real ROS peers, from the package index alone: made once, in build/, apart from the project's.

None of them is a dependency of the bridge. What cannot be installed is an error, never a skip.
"""

from __future__ import annotations

import fcntl
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
CACHE = ROOT / "build" / "ros2-peers"
REQUIREMENTS: dict[str, tuple[str, ...]] = {
    # two independent implementations of rmw_zenoh
    "pyzeros": ("pyzeros==0.1.0", "eclipse-zenoh==1.10.2"),
    "sdk": ("zenoh-ros2-sdk==0.1.8", "eclipse-zenoh==1.10.2"),
    # ROS 2 Kilted with FastDDS; and what the bridge itself needs, as it runs there with backend rclpy
    "rclpy": (
        "ros-rclpy[fastrtps]==9.1.2", "ros-std-msgs", "ros-std-srvs",
        "eclipse-zenoh>=1.10,<2", "pydantic>=2.12,<3", "pydantic-settings>=2.10,<3", "ruamel.yaml>=0.18",
        "structlog>=25", "prometheus-client>=0.22", "uvloop>=0.22",
    ),
}  # fmt: skip
PACKAGES = ("schemas", *(f"services/{room}" for room in ("model", "study", "runtime", "sources", "ros2_bridge")))
"""What the bridge needs of this repository, for ``PYTHONPATH`` in another environment."""


def python_of(name: str) -> str:
    """Return the interpreter of the environment ``name``, which is made if it does not exist."""
    CACHE.mkdir(parents=True, exist_ok=True)
    folder = CACHE / name
    stamp = folder / ".made"
    wanted = "\n".join(REQUIREMENTS[name])
    with open(CACHE / f"{name}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not stamp.is_file() or stamp.read_text() != wanted:
            shutil.rmtree(folder, ignore_errors=True)
            subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
            pip = [str(folder / "bin" / "python"), "-m", "pip", "--quiet", "--disable-pip-version-check"]
            subprocess.run([*pip, "install", *REQUIREMENTS[name]], check=True)
            stamp.write_text(wanted)
    return str(folder / "bin" / "python")


def work_folder() -> Path:
    """Return the working folder of peers: pyzeros compiles its codecs into it once."""
    folder = CACHE / "work"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
