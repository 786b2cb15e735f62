"""The bodies of REST requests that are not messages of the mesh themselves."""

from __future__ import annotations

from shift_schemas.requests import DecisionBody, MarkerBody, OverrideBody, PatchBody, PerformanceBody, StartBody

__all__ = ["DecisionBody", "MarkerBody", "OverrideBody", "PatchBody", "PerformanceBody", "StartBody"]
