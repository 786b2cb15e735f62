"""Stamps: ``{sec, nsec}`` on the wire, integer nanoseconds in the code. Pure.

A stamp has two fields because browsers lose digits of a JSON number of nanoseconds. The sequence number of a source
defines the order of its messages; a stamp never does.
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

NS = 1_000_000_000


class Stamp(BaseModel):
    """A point in time since the Unix epoch."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    sec: int = Field(ge=0, le=2**40, description="Whole seconds since the Unix epoch.")
    nsec: int = Field(ge=0, lt=NS, description="Nanoseconds within the second.")

    @classmethod
    def of(cls, ns: int) -> Stamp:
        """Return the stamp of ``ns`` nanoseconds since the epoch."""
        return cls(sec=ns // NS, nsec=ns % NS)

    @property
    def ns(self) -> int:
        """Nanoseconds since the epoch."""
        return self.sec * NS + self.nsec
