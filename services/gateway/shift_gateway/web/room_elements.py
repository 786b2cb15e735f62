"""Elements that the room view and a recording's view share: what to say, the state, the person, the gaze sources."""

from __future__ import annotations

import json
import re

from nicegui import ui
from shift_study.areas import Aoi
from shift_study.study import Study

from shift_gateway.web.gaze_quality import SourceQuality
from shift_gateway.web.layout import explain, testid, text
from shift_gateway.web.room_view import RoomView, corners_of

STIMULUS_PATH = "/page-stimulus"
"""Where the browser finds the images of studies."""
LONG_SAY = 40
"""A longer text is shown a little smaller, so that it fits; characters."""
TOOLTIPS = {
    "say": "What the robot says: the last decision's text, or else its strategy (paper, section III-B).",
    "state": "The cognitive state: what the scoring table reduces the observations to (paper, section III-C, Table I).",
    "capacity": "Processing capacity, which explanations draw on and repetition recharges (paper, section III-A1).",
    "stimulus": "The areas of interest, and the last point of each gaze source that sends points.",
}


class RoomElements:
    """The panels of a room view. Each ``add_`` draws one where the caller is; :meth:`show` fills all of them."""

    def __init__(self, study: Study) -> None:
        self._study = study
        self._texts: dict[str, ui.label] = {}
        self._shown_state = ""
        self._state_parts: list[ui.element] = []

    def add_text(self, name: str, classes: str = "", tag: str = "div") -> ui.label:
        """Draw one value by its ``data-testid``."""
        label = text("", classes, name, tag)
        self._texts[name] = label
        return label

    def add_say(self) -> ui.element:
        """Draw what to say; return the place for what follows after the session."""
        with ui.element("section").classes("panel left live").props('aria-label="What to say"'):
            text("SAY IT", "caption")
            explain(self.add_text("say", "say"), TOOLTIPS["say"])
            self.add_text("strategy", "strategy muted")
            self._origin = text("", "muted")
            ui.element("span").classes("grow")
            self.add_text("result-pending", "pending").props('role="status"')
            return ui.element("div")

    def add_state(self) -> None:
        """Draw the cognitive state."""
        with ui.element("section").classes("panel live").props('aria-label="Cognitive state"'):
            text("STATE", "caption")
            self._state = testid(ui.element("div").classes("state"), "cognitive-state")
            explain(self._state, TOOLTIPS["state"])
            self.add_text("why", "why")
            self._changed = text("", "why muted")

    def add_person(self) -> None:
        """Draw the stimulus, capacity and gaze."""
        study = self._study
        with ui.element("div").classes("person"):
            with ui.element("section").classes("panel stimulus live").props('aria-label="Stimulus"') as stimulus:
                explain(stimulus, TOOLTIPS["stimulus"])
                ui.html(stimulus_svg(study), sanitize=False)
            with ui.element("section").classes("panel live").props('aria-label="The person"'):
                text("capacity", "caption")
                with ui.element("div").classes("bar").style("gap: .5rem; align-items: baseline"):
                    self.add_text("capacity", "big")
                    self.add_text("capacity-class")
                with ui.element("div").classes("bar-outer") as bar:
                    explain(bar, TOOLTIPS["capacity"])
                    self._bar = ui.element("div").classes("bar-inner")
                    self._threshold = ui.element("div").classes("bar-threshold")
                text("gaze", "caption")
                self.add_text("gaze-class", "big").style("font-size: 1.5rem")
                with ui.element("div").classes("muted"):
                    for aoi in study.aoi_names:
                        with ui.element("div"):
                            text(f"{aoi} ", tag="span")
                            self.add_text(f"weight-{aoi}", tag="span")

    def show(self, view: RoomView) -> None:
        """Fill all panels."""
        values = {
            "decision-number": view.decision_number, "say": view.say, "strategy": view.strategy,
            "result-pending": view.result_pending, "why": view.why,
            "capacity": view.capacity, "capacity-class": view.capacity_class, "gaze-class": view.gaze_class,
            **{f"weight-{aoi}": view.weights.get(aoi, "") for aoi in self._study.aoi_names},
        }  # fmt: skip
        for name, value in values.items():
            if name in self._texts:
                self._texts[name].text = value
        self._show_state(view.cognitive_state)
        self._origin.text = view.origin
        self._changed.text = f"now: {view.changed_to}" if view.changed_to else ""
        self._texts["say"].classes(**_toggled("long", len(view.say) > LONG_SAY))
        self._bar.style(f"width: {100 * min(max(view.capacity_share, 0), 1):.0f}%")
        self._threshold.style(f"left: {100 * view.threshold_share:.0f}%")

    def _show_state(self, state: str) -> None:
        """Show the state's name, which may be broken after an underscore."""
        if state != self._shown_state:
            self._shown_state = state
            for part in self._state_parts:
                part.delete()
            with self._state:
                words = re.split("(?<=_)", state)
                self._state_parts = [part for word in words for part in (text(word, tag="span"), ui.element("wbr"))]


class GazeSources:
    """One line for each gaze source, with its quality."""

    def __init__(self) -> None:
        self._labels: dict[str, ui.label] = {}
        self._row = ui.element("div").classes("bar").style("width: auto; flex-wrap: nowrap")
        with self._row:
            self._none = text("no gaze yet", "muted")

    def show(self, sources: dict[str, SourceQuality]) -> None:
        """Show each source; one that is not among ``sources`` is hidden."""
        for name in sources.keys() - self._labels.keys():
            self._add(name)
        self._none.set_visibility(not sources)
        for name, label in self._labels.items():
            label.set_visibility(name in sources)
        for name, quality in sources.items():
            label = self._labels[name]
            label.text = f"GAZE {quality.text}" if len(sources) == 1 else f"{name} {quality.text}"
            label.classes(replace=quality.level)

    def _add(self, name: str) -> None:
        with self._row:
            label = self._labels[name] = testid(ui.label(), f"gaze-source-{name}")
            explain(label, f"Gaze source {name}: its rate and loss in the last 5 s, and the age of its last sample.")
        self._row.classes(**_toggled("many", len(self._labels) > 1))


def stimulus_script(view: RoomView) -> str:
    """Return the JavaScript that draws the gaze points and lights the AOIs that are looked at."""
    points = json.dumps([list(p) for p in view.points])
    looked_at = json.dumps(sorted({view.held_aoi, *view.looked_at} - {""}))
    return f"shift.stimulus({points}, {looked_at}, {json.dumps(view.moved)});"


def _toggled(name: str, wanted: bool) -> dict[str, str]:
    return {"add": name} if wanted else {"remove": name}


def stimulus_svg(study: Study) -> str:
    """Return the stimulus as SVG with its AOIs. Their names are ids, so that nothing in them is markup."""
    shapes = _image(study) + "".join(_shape(aoi) for aoi in study.aois)
    return (
        f'<svg viewBox="0 0 100 60" preserveAspectRatio="xMidYMid meet" role="img" aria-label="Areas of interest: '
        f'{", ".join(study.aoi_names)}"><rect class="aoi" x="0" y="0" width="100" height="60"/>{shapes}</svg>'
    )


def _image(study: Study) -> str:
    """Return the stimulus image under the AOIs; a file's name has no character that is markup."""
    if study.stimulus is None:
        return ""
    return f'<image href="{STIMULUS_PATH}/{study.stimulus}" width="100" height="60" preserveAspectRatio="none"/>'


def _shape(aoi: Aoi) -> str:
    corners = corners_of(aoi.rectangle or (), aoi.polygon or ())
    points = " ".join(f"{100 * x:.2f},{60 * y:.2f}" for x, y in corners)
    x, y = 100 * min(c[0] for c in corners) + 1.5, 60 * min(c[1] for c in corners) + 6
    name = aoi.name
    label = f'<text data-aoi-name="{name}" x="{x:.2f}" y="{y:.2f}">{name}</text>'
    return f'<polygon class="aoi" data-aoi="{name}" points="{points}"/>{label}'
