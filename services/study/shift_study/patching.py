"""JSON merge patches, and what a patch can change in a running session."""

from __future__ import annotations

from typing import Any


def merge_patch(target: Any, patch: Any) -> Any:
    """Return ``target`` after the merge patch (RFC 7386); null removes a key. Both arguments stay unchanged."""
    if not isinstance(patch, dict):
        return patch
    merged = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        if value is None:
            merged.pop(key, None)
        else:
            merged[key] = merge_patch(merged.get(key), value)
    return merged


def merge_patch_between(before: Any, after: Any) -> Any:
    """Return the JSON merge patch (RFC 7386) that turns ``before`` into ``after``."""
    if not isinstance(before, dict) or not isinstance(after, dict):
        return after
    patch = {key: merge_patch_between(before.get(key), v) for key, v in after.items() if before.get(key, ...) != v}
    return patch | dict.fromkeys(before.keys() - after.keys())
