"""``python -m shift_learner``: the learner as a process. Settings are environment variables, ``SHIFT_...``."""

from shift_runtime.process import run_service

from shift_learner.service import CORE


def main() -> None:
    """Run the learner."""
    run_service(CORE)


if __name__ == "__main__":
    main()
