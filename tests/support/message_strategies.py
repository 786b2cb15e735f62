"""Hypothesis strategies: ids, hostile ids, and JSON of any shape."""

from __future__ import annotations

from hypothesis import strategies as st

ids = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}", fullmatch=True)
HOSTILE_IDS = (
    "", "**", "*", "a/b", "../x", "..", ".", "a\0", "\0", "a\n", "\na", "a b", " a", "-a", "_a", "a.b", "@service",
    "a" * 64, "a" * 65536, "ä", "a\u200b", "%2e%2e", "a$", "\ud800", "Ａ",
)  # fmt: skip
"""Texts that Zenoh, a file system or a URL would misread, and texts that only look like ids."""

json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=10), inner, max_size=4),
    max_leaves=12,
)
