"""A study in the browser: shown, edited with its mistakes at their lines, and saved under a new name."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect
from shift_gateway.web.study_view import checked_text, table_rows, triple_rows
from shift_model.vocabulary import TRIPLES
from shift_runtime.rest_client import RestClient
from shift_study.scoring import reduce
from shift_study.study import Study
from support.browser import WAIT_MS, Tab
from support.whole_mesh import LiveMesh

TITLE = "<img src=x onerror=\"document.title='interpreted'\">"


def type_study(tab: Tab, text: str) -> None:
    """Replace the editor's text."""
    tab.find("study-editor").locator(".cm-content").click()
    tab.page.keyboard.press("ControlOrMeta+a")
    tab.page.keyboard.press("Delete")
    tab.page.keyboard.insert_text(text)


def test_every_triple_has_the_state_of_the_scoring_system() -> None:
    study = Study(study="s")
    rows = triple_rows(study)
    assert [r["triple"] for r in rows] == [t.name for t in TRIPLES]
    assert [r["state"] for r in rows] == [reduce(study.scoring, t).cognitive_state for t in TRIPLES]
    assert len(table_rows(study)) == 1 + 10


def test_mistake_has_its_line_and_another_name_is_a_warning() -> None:
    checked = checked_text("study: mine\ninteractions: none\n", "mine")
    assert checked.study is None
    assert (checked.remarks[0].line, checked.remarks[0].is_mistake) == (2, True)
    assert "interactions" in checked.remarks[0].sentence
    renamed = checked_text("study: mine\n", "other")
    assert renamed.study is not None
    assert renamed.remarks[0].sentence.startswith("the file is other.yaml, and its study is mine")


def test_study_is_shown_under_each_condition(tab: Tab) -> None:
    tab.go("/study/coffee")
    tab.wait_text("study-title", "Making coffee with a robot")
    tab.wait_text("study-triples", "high/focused/unknown")
    tab.wait_text("study-table", "gaze: distracted")
    assert tab.find("study-aois").locator("[data-aoi=cup]").count() == 1
    tab.choose("study-condition", "control")
    tab.wait_text("study-triples", "engaged_observer")


def test_mistakes_are_shown_while_typing_and_a_study_is_saved_and_started(tab: Tab, mesh: LiveMesh) -> None:
    tab.go("/study/default")
    tab.wait_text("study-mistakes", "No mistakes.")
    type_study(tab, f"study: typed\ninteractions: none\ntitle: '{TITLE.replace(chr(39), chr(39) * 2)}'\n")
    tab.wait_text("study-mistakes", "line 2: ")
    tab.fill("study-save-name", "typed")
    tab.click("study-save")
    tab.page.get_by_text("The study has mistakes; it is not saved.").wait_for(timeout=WAIT_MS)
    assert not (mesh.data / "studies" / "typed.yaml").exists()
    type_study(tab, f"study: typed\ninteractions: 24\ntitle: '{TITLE.replace(chr(39), chr(39) * 2)}'\n")
    tab.wait_text("study-mistakes", "No mistakes.")
    tab.wait_text("study-title", TITLE)
    tab.click("study-save")
    tab.page.get_by_text("Saved: sessions can be started with typed.").wait_for(timeout=WAIT_MS)
    assert tab.page.title() != "interpreted"
    with RestClient(mesh.url) as shift:
        shift.start("P01", session="typed1", study="typed")
        assert shift.config("typed1")["interactions"] == 24
    tab.click("study-save")
    tab.page.get_by_text("There is a study typed already").wait_for(timeout=WAIT_MS)


@pytest.mark.parametrize("name", ["../x", "", "a b"])
def test_name_that_is_not_an_id_is_refused(tab: Tab, mesh: LiveMesh, name: str) -> None:
    tab.go("/study/default")
    tab.wait_text("study-mistakes", "No mistakes.")
    tab.fill("study-save-name", name)
    tab.click("study-save")
    tab.page.get_by_text("cannot be a study's name").wait_for(timeout=WAIT_MS)


def test_unknown_study_lists_the_known_ones(tab: Tab) -> None:
    tab.go("/study/nothing")
    tab.page.get_by_text("there is no study of that name").wait_for(timeout=WAIT_MS)
    expect(tab.page.get_by_role("link", name="coffee", exact=True)).to_have_attribute("href", "/study/coffee")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_study_has_no_serious_finding_of_axe(open_tab, dark: bool) -> None:
    with open_tab(dark=dark) as tab:
        tab.go("/study/coffee")
        tab.wait_text("study-triples", "high/focused/unknown")
        tab.page.locator(".q-table__middle[tabindex]").first.wait_for()
        assert tab.serious_findings() == []
