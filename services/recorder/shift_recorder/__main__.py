"""``python -m shift_recorder``: the recorder as a process. Settings are environment variables, ``SHIFT_...``."""

from shift_runtime.process import run_service

from shift_recorder.service import CORE, extend


def main() -> None:
    """Run the recorder."""
    run_service(CORE, extend)


if __name__ == "__main__":
    main()
