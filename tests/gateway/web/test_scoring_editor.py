"""Weights and table entries are edited in a browser; what the edits change is shown before they are applied."""

from __future__ import annotations

from shift_runtime.rest_client import RestClient
from shift_study.loading import patched, study_json, study_of
from shift_study.scoring import reductions
from support.browser import Tab

PATCH = {"scoring": {"strategies": {"negation": {"weight": 0.5}}}}


def moved(shift: RestClient, session: str) -> dict[str, tuple[str, str]]:
    """Return the triples that :data:`PATCH` moves, by the session's own study."""
    study = study_of({k: v for k, v in shift.config(session).items() if k != "version"})
    before, after = reductions(study_json(study)), reductions(study_json(patched(study, PATCH)))
    pairs = {t.name: (before[t].cognitive_state, after[t].cognitive_state) for t in before}
    return {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}


def test_triples_that_would_change_are_shown_and_then_applied(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="edit1", study="coffee", seed=7)
    wanted = moved(shift, "edit1")
    tab.go("/session/edit1/desk")
    tab.fill("strategy-weight-negation", "0.5")
    tab.click("preview")
    tab.wait_text("triples-summary", f"{len(wanted)} of 30 triples would change")
    rows = [row.split() for row in tab.page.locator('[data-testid="triples"] tbody tr').all_text_contents()]
    assert {name: (before, after) for name, before, after in rows} == wanted
    assert shift.config("edit1")["scoring"]["strategies"]["negation"]["weight"] == 1.0
    tab.fill("author", "Anna")
    tab.click("apply")
    tab.wait_text("changes", "scoring.strategies.negation.weight 1.0 → 0.5")
    tab.wait_text("changes", "Anna")
    tab.wait_text("triples-summary", "Nothing is edited.")
    assert shift.config("edit1")["scoring"]["strategies"]["negation"]["weight"] == 0.5
    assert shift.config("edit1")["version"] == 2


def test_inputs_follow_what_another_person_applies_unless_they_are_edited(open_tab, shift: RestClient) -> None:
    shift.start("P01", session="edit2", study="coffee", seed=7)
    with open_tab() as anna, open_tab() as ben:
        anna.go("/session/edit2/desk")
        ben.go("/session/edit2/desk")
        anna.fill("strategy-weight-negation", "0.9")
        anna.wait_text("triples-summary", "1 edited value")
        ben.fill("strategy-weight-negation", "0.5")
        ben.fill("table-low-negation", "1")
        ben.click("apply")
        anna.wait_text("changes", "scoring.table.capacity.low.negation 0.0 → 1.0")
        anna.page.wait_for_function("() => document.querySelector('[data-testid=table-low-negation]').value === '1'")
        assert anna.find("strategy-weight-negation").input_value() == "0.9", "it is being edited"
        anna.click("apply")
        ben.page.wait_for_function(
            "() => document.querySelector('[data-testid=strategy-weight-negation]').value === '0.9'"
        )
        assert shift.config("edit2")["scoring"]["table"]["capacity"]["low"]["negation"] == 1.0


def test_value_that_is_refused_is_named(tab: Tab, shift: RestClient) -> None:
    shift.start("P01", session="edit3", study="coffee", seed=7)
    tab.go("/session/edit3/desk")
    tab.fill("table-high-hesitation", "7")
    tab.wait_text("triples-summary", "table.capacity.high.hesitation")
    tab.click("apply")
    tab.page.locator(".q-notification").first.wait_for()
    assert shift.config("edit3")["version"] == 1
    tab.click("discard")
    tab.wait_text("triples-summary", "Nothing is edited.")
