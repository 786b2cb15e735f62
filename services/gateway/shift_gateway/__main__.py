"""``python -m shift_gateway``: the gateway as a process. Settings are environment variables, ``SHIFT_...``."""

from shift_gateway.service import run_gateway

if __name__ == "__main__":
    run_gateway()
