"""A browser for the tests of the web page: Debian's Chromium, driven by playwright."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Locator, Page, sync_playwright

CHROMIUM = shutil.which("chromium") or "/usr/bin/chromium"
WAIT_MS = 30_000
"""How long a test waits for what it expects before it fails, ms. No test asserts anything about it."""
SERIOUS = ("serious", "critical")


@contextmanager
def chromium() -> Iterator[Browser]:
    """Run the browser until the context is left. ``apt install chromium`` installs it."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        try:
            yield browser
        finally:
            browser.close()


@dataclass
class Tab:
    """One open page, found by its ``data-testid``s."""

    page: Page
    origin: str
    errors: list[str] = field(default_factory=list)
    foreign: list[str] = field(default_factory=list)
    """Requests to another host; there must be none."""

    def go(self, path: str) -> None:
        """Open a path of the gateway."""
        self.page.goto(self.origin + path)

    def find(self, name: str) -> Locator:
        """Return the element with this ``data-testid``."""
        return self.page.locator(f'[data-testid="{name}"]')

    def text(self, name: str) -> str:
        """Return the plain text of an element."""
        return (self.find(name).text_content(timeout=WAIT_MS) or "").strip()

    def wait_text(self, name: str, wanted: str) -> None:
        """Wait until the element contains a text."""
        self.page.wait_for_function(
            "([name, wanted]) => [...document.querySelectorAll(`[data-testid=\"${name}\"]`)]"
            ".some(e => (e.textContent || e.value || '').includes(wanted))",
            arg=[name, wanted], timeout=WAIT_MS,
        )  # fmt: skip

    def click(self, name: str) -> None:
        """Click an element."""
        self.find(name).click(timeout=WAIT_MS)

    def fill(self, name: str, value: str) -> None:
        """Write into an input."""
        found = self.find(name)
        found.wait_for(timeout=WAIT_MS)
        tag = found.evaluate("e => e.tagName.toLowerCase()")
        (found if tag in ("input", "textarea") else found.locator("input, textarea").first).fill(value)

    def choose(self, name: str, option: str) -> None:
        """Choose an option of a select."""
        self.click(name)
        self.page.get_by_role("option", name=option, exact=True).click(timeout=WAIT_MS)

    def serious_findings(self) -> list[str]:
        """Return what axe-core calls serious or critical on this page."""
        found = Axe().run(self.page).response["violations"]
        return [
            f"{v['id']}: {v['help']}: {[n['html'][:160] for n in v['nodes'][:3]]}"
            for v in found
            if v["impact"] in SERIOUS
        ]


@contextmanager
def opened_tab(
    browser: Browser, origin: str, dark: bool = False, width: int = 1280, height: int = 800
) -> Iterator[Tab]:
    """Open an empty tab. The scripts' errors and requests to other hosts are collected."""
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme="dark" if dark else "light", accept_downloads=True
    )
    try:
        tab = Tab(context.new_page(), origin)
        tab.page.on("pageerror", lambda e: tab.errors.append(str(e)))
        tab.page.on(
            "request",
            lambda r: None if r.url.startswith((origin, "data:", "blob:")) else tab.foreign.append(r.url),
        )
        yield tab
        assert not tab.errors, tab.errors
        assert not tab.foreign, tab.foreign
    finally:
        context.close()
