"""A fold that stops at its first difference, or where an unfinished recording does not say more."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

from shift_schemas.errors import ShiftError, shorten
from shift_schemas.messages import Observation

from shift_verify.difference import LAST, Difference, Differs, FactAtPlace, NotRecorded

FAILURES = (ShiftError, ValueError, LookupError, TypeError, AssertionError)
"""What a core can raise if it is given nonsense."""


class GuardedFold:
    """A fold over the outputs of one owner, whose differences are collected.

    Parameters
    ----------
    owner
        The service that published the outputs.
    fold
        Has ``checked``, ``take``, and where they are called ``gap`` and ``end``.
    differences
        Receives the first difference of the fold.
    reasons
        Receives why the fold could not go on, if the recording is unfinished.
    """

    def __init__(self, owner: str, fold: Any, differences: list[Differs], reasons: list[str]) -> None:
        self._owner = owner
        self._fold = fold
        self._differences = differences
        self._reasons = reasons
        self._stopped = False
        self.differs = False
        """Whether the fold found a difference."""

    @property
    def checked(self) -> Counter[str]:
        """The number of messages that are as derived, by subject."""
        checked: Counter[str] = self._fold.checked
        return checked

    def take(self, given: FactAtPlace | Observation) -> None:
        """Derive up to the next fact."""
        self._do(self._fold.take, given)

    def gap(self, following: FactAtPlace) -> None:
        """Report what is lost before ``following``, and stop."""
        self._do(self._fold.gap, following)
        self._stopped = True

    def end(self) -> None:
        """Derive the rest: no more facts follow."""
        self._do(self._fold.end)

    def _do(self, action: Callable[..., None], *given: object) -> None:
        if self._stopped:
            return
        self._stopped = True
        try:
            action(*given)
            self._stopped = False
        except Differs as e:
            self._add(e)
        except NotRecorded as e:
            self._reasons.append(str(e))
        except FAILURES as e:
            why = f"the {self._owner}'s core cannot go on with what is recorded: {shorten(str(e) or type(e).__name__)}"
            self._add(Differs(LAST, Difference(self._owner, 0, "", None, None, why)))

    def _add(self, difference: Differs) -> None:
        self._differences.append(difference)
        self.differs = True
