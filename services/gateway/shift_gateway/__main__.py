"""``python -m shift_gateway``: the gateway as a process. Settings are environment variables, ``SHIFT_...``."""

from shift_gateway.service import run_gateway


def main() -> None:
    """Run it."""
    run_gateway()


if __name__ == "__main__":
    main()
