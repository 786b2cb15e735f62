"""``python -m shift_monitor``: the monitor as a process. Settings are environment variables, ``SHIFT_...``."""

from shift_runtime.process import run_service

from shift_monitor.service import CORE


def main() -> None:
    """Run the monitor."""
    run_service(CORE)


if __name__ == "__main__":
    main()
