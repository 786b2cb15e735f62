"""``python -m shift_gateway``: run the gateway as a process. Its settings are environment variables, ``SHIFT_...``."""

from shift_gateway.service import run_gateway


def main() -> None:
    """Run the gateway."""
    run_gateway()


if __name__ == "__main__":
    main()
