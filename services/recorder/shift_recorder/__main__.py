"""``python -m shift_recorder``: the recorder as a process. Settings are environment variables, ``SHIFT_...``."""

from shift_runtime.process import run_service

from shift_recorder.service import CORE, RecorderWorker


def main() -> None:
    """Run it."""
    run_service(CORE, RecorderWorker)


if __name__ == "__main__":
    main()
