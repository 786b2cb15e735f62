"""A panel with a heading."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui

from shift_gateway.web.layout import text


@contextmanager
def panel(title: str, wide: bool = False, anchor: str = "") -> Iterator[ui.label]:
    """Show a panel, into which the ``with`` block puts its elements; the block gets the heading.

    ``anchor`` is the name with which a link of the page leads to it.
    """
    section = ui.element("section").classes("panel live" + (" wide" if wide else ""))
    section.props["aria-label"] = title
    if anchor:
        section.props["id"] = anchor
    with section:
        yield text(title, tag="h2")
