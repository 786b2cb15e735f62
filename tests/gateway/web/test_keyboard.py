"""A session with the keyboard alone: started, steered, reported and ended, with Tab, arrows, Enter and Space."""

from __future__ import annotations

from dataclasses import dataclass

from shift_runtime.rest_client import RestClient
from support.browser import Tab

MOST_STEPS = 150
"""So many times Tab is pressed at most to reach an element."""
FOCUSED = """(name) => {
  const e = document.activeElement;
  const marked = e && e.closest(`[data-testid="${name}"]`);
  return Boolean(marked);
}"""

OPTION = "() => document.querySelector('.q-menu .q-manual-focusable--focused')?.textContent.trim() ?? ''"
"""The text of the option that the arrow keys have reached."""


@dataclass
class Keyboard:
    """Uses a page without a mouse."""

    tab: Tab

    def to(self, name: str) -> None:
        """Press Tab until the element with this ``data-testid`` has the focus."""
        self.tab.find(name).first.wait_for(state="attached")
        for _ in range(MOST_STEPS):
            if self.tab.page.evaluate(FOCUSED, name):
                return
            self.press("Tab")
        raise AssertionError(f"{name} is not reached by Tab")

    def press(self, *keys: str) -> None:
        for key in keys:
            self.tab.page.keyboard.press(key)

    def write(self, name: str, text: str) -> None:
        """Replace the content of an input."""
        self.to(name)
        self.press("ControlOrMeta+a")
        self.tab.page.keyboard.type(text)

    def choose(self, name: str, option: str) -> None:
        """Choose an option of a select: open it, go down to the option, and confirm."""
        self.to(name)
        self.press("Enter")
        wanted = self.tab.page.get_by_role("option", name=option, exact=True)
        wanted.wait_for()
        while (at := self.tab.page.evaluate(OPTION)) != option:
            self.press("ArrowDown")
            self.tab.page.wait_for_function(f"at => ({OPTION})() !== at", arg=at)
        self.press("Enter")
        wanted.wait_for(state="hidden")

    def activate(self, name: str) -> None:
        """Go to a button and press Enter."""
        self.to(name)
        self.press("Enter")


def test_session_is_started_steered_and_ended_with_the_keyboard_alone(tab: Tab, shift: RestClient) -> None:
    keyboard = Keyboard(tab)
    tab.go("/")
    tab.wait_text("start-participant", "P")
    keyboard.write("start-participant", "P77")
    keyboard.choose("start-study", "coffee: Making coffee with a robot")
    keyboard.choose("start-condition", "adaptive")
    keyboard.write("start-session", "keys")
    keyboard.activate("start")
    tab.page.wait_for_url("**/session/keys")
    assert shift.session("keys")["condition"] == "adaptive"

    keyboard.write("marker-text", "noted by hand")
    keyboard.activate("marker")
    keyboard.choose("override-task", "turn")
    keyboard.choose("override-negation", "negation")
    keyboard.choose("override-hesitation", "hesitation")
    keyboard.activate("override")
    tab.page.get_by_text("next turn:").wait_for()
    decision = shift.decide("keys", "turn")
    assert decision["strategy"] == {"negation": "negation", "hesitation": "hesitation"}

    keyboard.activate("desk")
    tab.page.wait_for_url("**/session/keys/desk")
    tab.page.get_by_text("Decision 1, turn: no result yet.").wait_for()
    keyboard.write("result-duration", "4.5")
    keyboard.to("result-comprehension")
    keyboard.press("Space")
    keyboard.activate("result")
    tab.wait_text("awareness-turn", "misconception_enabledness")

    tab.go("/session/keys")
    keyboard.activate("end")
    keyboard.activate("end-confirm")
    tab.page.get_by_text("This session has ended").wait_for()
    counts = shift.session("keys")["counts"]
    assert (counts["marker"], counts["override"], counts["performance"]) == (1, 1, 1)
