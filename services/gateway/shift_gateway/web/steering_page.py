"""The steering of a session on the desk: the scoring table, the learner, results, overrides, markers and changes."""

from __future__ import annotations

import json
from typing import Any

from nicegui import ui
from shift_schemas.errors import ShiftError
from shift_schemas.messages import Command, Configure, Mark, PatchBody, ReportPerformance, SetOverride
from shift_schemas.requests import PerformanceBody, body_type
from shift_study.study import Study

from shift_gateway.gateway import Gateway
from shift_gateway.web.desk_view import Change, changes
from shift_gateway.web.history import SessionHistory
from shift_gateway.web.layout import explain, show_error, testid, text
from shift_gateway.web.steering_view import Path, entries, open_decisions, patch_of, preview, standing_markers
from shift_gateway.web.wording import clock_time, spoken

AUTHOR_LENGTH = 100


class SteeringPanel:
    """What the experimenter changes in a running session."""

    def __init__(self, gateway: Gateway, name: str, history: SessionHistory) -> None:
        self._gateway = gateway
        self._name = name
        self._history = history
        self._inputs: dict[Path, ui.number] = {}
        self._edited: set[Path] = set()
        self._following = False
        study = history.study() or Study(study="default")
        with ui.element("section").classes("panel"):
            with ui.element("div").classes("bar"):
                text("Steering", tag="h2")
                ui.element("span").classes("grow")
                self._author = testid(
                    ui.input("Your name", on_change=self._keep_author).props("dense outlined"), "author"
                )
                explain(self._author, "It is recorded with each change that you make here.")
            with ui.element("div").classes("columns even"):
                self._scoring(study)
                with ui.element("div").classes("form"):
                    self._learner()
                    self._results()
                    self._lists()
        ui.timer(0.1, self._restore_author, once=True)

    # --- the elements ---

    def _scoring(self, study: Study) -> None:
        with ui.element("div").classes("form"):
            text("Scoring table (paper, Table I)", tag="h3")
            with ui.element("div").classes("grid").style(f"--columns: {len(study.scoring.strategies)}"):
                text("")
                for name in study.scoring.strategies:
                    text(name, "caption")
                text("weight", "caption")
                for name in study.scoring.strategies:
                    self._number(("weight", name), f"strategy-weight-{name}", f"weight of {name}")
                for category in dict.fromkeys(p[1] for p in entries(study) if p[0] == "table"):
                    text(category, "caption")
                    for name in study.scoring.strategies:
                        self._number(("table", category, name), f"table-{category}-{name}", f"{category}, {name}")
            text("Triples whose cognitive state would change:", "caption")
            self._triples = testid(ui.element("div").classes("lines").props('role="status"'), "triples")
            with ui.row():
                testid(ui.button("Apply", on_click=self._apply).props("outline"), "apply")
                testid(ui.button("Discard", on_click=self._discard).props("flat"), "discard")

    def _number(self, path: Path, name: str, label: str) -> None:
        field = ui.number(value=0, min=0, step=0.1, on_change=lambda: self._on_edit(path))
        field.props(f'dense outlined aria-label="{label}"').on("keydown.enter", self._apply)
        self._inputs[path] = testid(field, name)

    def _learner(self) -> None:
        text("Learner", tag="h3")
        self._paused = testid(ui.checkbox("paused", on_change=self._on_paused), "learner-paused")
        explain(self._paused, "Results are recorded while the learner is paused, and nothing is learned from them.")

    def _results(self) -> None:
        text("Result by hand", tag="h3")
        self._decision = testid(ui.input("Decision").props("dense outlined"), "result-decision")
        explain(self._decision, "The decision's id. A result for a decision that has one already replaces it.")
        with ui.row():
            self._comprehension = testid(ui.checkbox("understood", value=True), "result-comprehension")
            self._enabledness = testid(ui.checkbox("able to do it", value=True), "result-enabledness")
            duration = ui.number("Duration in s", value=5, min=0).props("dense outlined")
            self._duration = testid(duration, "result-duration")
            testid(ui.button("Report", on_click=self._report).props("outline"), "result")

    def _lists(self) -> None:
        text("Overrides that no decision used yet", tag="h3")
        self._overrides = testid(ui.element("div").classes("lines"), "overrides")
        text("Markers", tag="h3")
        self._markers = testid(ui.element("div").classes("lines"), "markers")
        text("Changes of the configuration", tag="h3")
        self._changes = testid(ui.element("div").classes("lines"), "changes")

    # --- what a click does ---

    async def _command(self, kind: type[Command], body: Any, done: str, **further: str) -> bool:
        """Carry out a command; return whether it was. A refusal is shown."""
        try:
            await self._gateway.api.command(kind, self._name, body, **further)
        except ShiftError as e:
            show_error(e)
            return False
        ui.notify(done, type="positive")
        return True

    @property
    def _who(self) -> str:
        return str(self._author.value or "").strip()[:AUTHOR_LENGTH]

    async def _configure(self, patch: dict[str, Any], done: str) -> bool:
        return await self._command(Configure, PatchBody(patch), done, author=self._who)

    async def _apply(self) -> None:
        study = self._history.study()
        patch = patch_of(study, self._values()) if study else {}
        if not patch:
            ui.notify("Nothing was changed.", type="warning")
        elif await self._configure(patch, "The change is in force."):
            self._edited.clear()

    def _discard(self) -> None:
        self._edited.clear()
        self._follow()

    async def _on_paused(self) -> None:
        if not self._following:
            paused = bool(self._paused.value)
            done = "The learner is paused." if paused else "The learner goes on."
            if not await self._configure({"learner": {"paused": paused}}, done):
                self._follow()

    async def _report(self) -> None:
        try:
            body = PerformanceBody.model_validate(self._result(), strict=False)
        except ValueError:
            ui.notify("Give the decision's id, and a duration of at least 0 s.", type="warning")
            return
        await self._command(ReportPerformance, body, "The result is kept.")

    def _result(self) -> dict[str, Any]:
        decision, duration = str(self._decision.value or "").strip(), self._duration.value
        known = decision in {p.decision_id for p in self._history.performances.until()}
        return {
            "decision_id": decision,
            "comprehension": {"success": bool(self._comprehension.value), "duration_s": duration},
            "enabledness": {"success": bool(self._enabledness.value), "duration_s": duration},
            "corrects": known,
            "author": self._who,
        }

    async def _undo(self, change: Change) -> None:
        await self._configure(change.undo, f"Change {change.version} is taken back.")

    async def _withdraw(self, task: str, override: str) -> None:
        body = body_type(SetOverride)(task=task, withdraws=override, author=self._who)
        await self._command(SetOverride, body, "The override is withdrawn.")

    async def _retract(self, marker: str) -> None:
        body = body_type(Mark)(text="retracted", retracts=marker, author=self._who)
        await self._command(Mark, body, "The marker is retracted; both stay in the recording.")

    def _keep_author(self) -> None:
        ui.run_javascript(f"shift.author({json.dumps(self._who)})")

    async def _restore_author(self) -> None:
        self._author.value = await ui.run_javascript("shift.author()")

    # --- what changes ---

    def _values(self) -> dict[Path, float]:
        return {path: float(field.value) for path, field in self._inputs.items() if field.value is not None}

    def _on_edit(self, path: Path) -> None:
        if not self._following:
            self._edited.add(path)
            self._show_triples()

    def _show_triples(self) -> None:
        study = self._history.study()
        self._triples.clear()
        with self._triples:
            for line in preview(study, self._values()) if study else ():
                text(line)

    def show(self) -> None:
        """Show the configuration, overrides, markers and changes as they are now."""
        self._follow()
        waiting = open_decisions(self._history)
        if waiting and not self._decision.value:
            self._decision.value = waiting[0]
        self._decision.set_autocomplete([d.decision_id for d in self._history.decisions.until()][-50:])
        self._show_lists()

    def _follow(self) -> None:
        """Give each input that is not being edited the value in force."""
        study = self._history.study()
        if study is None:
            return
        self._following = True
        for path, value in entries(study).items():
            if path in self._inputs and path not in self._edited:
                self._inputs[path].value = value
        self._paused.value = study.learner.paused
        self._following = False
        self._show_triples()

    def _show_lists(self) -> None:
        self._overrides.clear()
        with self._overrides:
            for task, o in self._history.pending_overrides().items():
                who = f", {o.author}" if o.author else ""
                self._line(
                    f"{task}: {spoken(o.strategy)}{who}",
                    "Withdraw",
                    lambda t=task, i=o.override_id: self._withdraw(t, i),
                )
        self._markers.clear()
        with self._markers:
            for marker, retracted in standing_markers(self._history):
                line = f"{clock_time(marker.stamp.ns)} {marker.text}" + (" (retracted)" if retracted else "")
                self._line(line, "" if retracted else "Retract", lambda i=marker.marker_id: self._retract(i))
        self._changes.clear()
        with self._changes:
            for change in changes(self._history.configs.until()):
                self._line(change.text, "Undo", lambda c=change: self._undo(c), "undo")

    def _line(self, line: str, action: str, on_click: Any, name: str = "") -> None:
        with ui.element("div").classes("bar line"):
            text(line).classes("grow")
            if action:
                button = ui.button(action, on_click=on_click).props("outline dense")
                if name:
                    testid(button, name)
