"""``python -m shift_ros2``: the bridge as a process; the command line is that of ``shift-mesh ros2``."""

import sys

from shift_ros2.service import run_bridge


def main() -> None:
    """Run the bridge."""
    run_bridge(sys.argv[1:])


if __name__ == "__main__":
    main()
