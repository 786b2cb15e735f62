"""Recognition of numpy arrays without an import of numpy.

Most services use the scalar path only. They start faster and need 10 MB less memory without numpy.
"""

from __future__ import annotations

import sys


def is_array(value: object) -> bool:
    """Return whether ``value`` is a numpy array. There is none in a process that has not imported numpy."""
    numpy = sys.modules.get("numpy")
    return numpy is not None and isinstance(value, numpy.ndarray)
