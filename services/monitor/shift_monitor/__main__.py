"""``python -m shift_monitor``: the monitor as a process. Settings are environment variables, ``SHIFT_...``."""

from shift_monitor.service import CORE
from shift_runtime.process import run_service

if __name__ == "__main__":
    run_service(CORE)
