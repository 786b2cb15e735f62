"""Simulated users by name: the name of one of the paper's users, or the path of a user file."""

from __future__ import annotations

from pathlib import Path

from shift_schemas.errors import InvalidSettings, shorten
from shift_schemas.suggestions import did_you_mean

from shift_simulator.users import PAPER_USERS, User, paper_user, parse_user


def find_user(name: str) -> User:
    """Return user A, B, C or D of the paper, or the user of the file ``name``.

    Raises
    ------
    InvalidSettings
        There is no such user and no such file, the file cannot be read, or it has a mistake.
    """
    return paper_user(name) if name in PAPER_USERS else parse_user(_read_text(name), name)


def _read_text(name: str) -> str:
    try:
        return Path(name).read_text(encoding="utf-8-sig")
    except FileNotFoundError as e:
        known = ", ".join(PAPER_USERS)
        meant = did_you_mean(name, PAPER_USERS)
        raise InvalidSettings(
            f"there is no simulated user {shorten(name)!r}, and no file of that name; "
            f"write {known} or the path of a user file{meant}"
        ) from e
    except UnicodeDecodeError as e:
        raise InvalidSettings(f"{name} is not text in UTF-8, so it is not a user file; give one in JSON") from e
    except (OSError, ValueError) as e:  # a folder, no permission, a null character in the name
        reason = e.strerror if isinstance(e, OSError) else e
        raise InvalidSettings(f"the user file {shorten(name)} cannot be read: {reason}") from e
