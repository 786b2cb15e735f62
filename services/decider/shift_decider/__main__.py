"""``python -m shift_decider``: the decider as a process. Settings are environment variables, ``SHIFT_...``."""

from shift_runtime.process import run_service

from shift_decider.service import CORE


def main() -> None:
    """Run the decider."""
    run_service(CORE)


if __name__ == "__main__":
    main()
