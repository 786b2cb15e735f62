"""The frame of every page: its head, the links, light and dark, and the helpers that all pages use."""

from __future__ import annotations

from typing import TypeVar

from nicegui import ui
from shift_schemas.errors import ShiftError

E = TypeVar("E", bound=ui.element)
HEAD = '<link rel="stylesheet" href="/page-assets/page.css"><script src="/page-assets/page.js"></script>'
THEMES = {"auto": None, "light": False, "dark": True}


def testid(element: E, name: str) -> E:
    """Give an element the name by which tests and screen readers' tools find it."""
    element.props["data-testid"] = name
    return element


def explain(element: E, text: str) -> E:
    """Add a tooltip that says what an element shows and where its rule stands."""
    with element:
        ui.tooltip(text).props("delay=400")
    return element


def text(content: str = "", classes: str = "", name: str = "", tag: str = "div") -> ui.label:
    """Show text, never HTML: what comes from outside is not interpreted."""
    label = ui.label(content).classes(classes)
    label.tag = tag
    return testid(label, name) if name else label


class Frame:
    """The head of a page. ``links`` shows the navigation, which the room view leaves out."""

    def __init__(self, title: str, links: bool = True) -> None:
        ui.page_title(f"{title} - SHIFT mesh")
        ui.add_head_html(HEAD)
        self.dark = ui.dark_mode(None)
        self._shortcuts: ui.checkbox | None = None
        ui.label().classes("old-values").props('role="status" aria-live="polite"')
        if links:
            with ui.element("nav").classes("bar").style("padding: .6rem 1rem"):
                ui.link("SHIFT mesh", "/").style("font-weight: 700")
                ui.link("Recordings", "/recordings")
                ui.link("Evaluation", "/evaluation")
                ui.link("REST paths", "/docs")
                ui.element("span").classes("grow")
                self._shortcuts = ui.checkbox("shortcuts", value=True, on_change=self._set_shortcuts)
                explain(self._shortcuts, "Single keys in the room view: m marker, o override, e end.")
                self.theme_button()
        ui.timer(0.05, self._restore, once=True)

    def theme_button(self) -> ui.button:
        """Show the button that changes between the system's colours, light and dark."""
        self._button = ui.button("colours: auto", on_click=self._next_theme).props("flat dense")
        return self._button

    async def _restore(self) -> None:
        """Show what this browser chose before."""
        await self._set(await ui.run_javascript("shift.theme()"))
        if self._shortcuts is not None:
            self._shortcuts.value = bool(await ui.run_javascript("shift.shortcuts()"))

    def _set_shortcuts(self) -> None:
        assert self._shortcuts is not None
        ui.run_javascript(f"shift.shortcuts({'true' if self._shortcuts.value else 'false'})")

    async def _next_theme(self) -> None:
        names = list(THEMES)
        now = await ui.run_javascript("shift.theme()")
        name = names[(names.index(now) + 1) % len(names)] if now in names else "auto"
        await self._set(await ui.run_javascript(f"shift.theme('{name}')"))

    async def _set(self, name: str) -> None:
        name = name if name in THEMES else "auto"
        self.dark.value = THEMES[name]
        if hasattr(self, "_button"):
            self._button.text = f"colours: {name}"


def show_error(error: ShiftError) -> None:
    """Show a refusal: its sentence, and the rule of each wrong field."""
    rules = [f"{e.field}: {e.rule}" for e in error.errors if e.rule not in error.detail]
    ui.notify("\n".join([error.detail, *rules]), type="negative", multi_line=True, timeout=12_000, close_button="close")
