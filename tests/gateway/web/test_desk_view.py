"""What the desk computes: contributions of the table, changes of the configuration, previews of an edit."""

from __future__ import annotations

import json

import pytest
from shift_gateway.web.desk_view import changes, state_changes
from shift_gateway.web.steering_view import entries, patch_of, preview
from shift_model.vocabulary import TRIPLES
from shift_schemas.messages import Config
from shift_schemas.timestamps import Stamp
from shift_study.loading import patched, study_from_json, study_json
from shift_study.patching import merge_patch
from shift_study.scoring import reduce
from shift_study.study import Study

STUDY = Study(study="s")
THIRD = Study.model_validate(
    {
        "study": "s",
        "scoring": {
            "strategies": {"tempo": {"levels": ["normal", "slow"], "thresholds": [0.5]}},
            "table": {
                part: {category: {"tempo": 1} for category in categories}
                for part, categories in {
                    "capacity": ["low", "high"],
                    "gaze": ["distracted", "uncertain", "focused"],
                    "awareness": [
                        "unknown", "failure", "misconception_enabledness", "misconception_comprehension", "success"
                    ],
                }.items()
            },
        },
    }
)  # fmt: skip


def configs(*studies: Study) -> list[Config]:
    """Return the configurations of a session with these studies in force, one after the other."""
    return [
        Config(session="s1", stamp=Stamp.of(n), version=n, study=study_json(study), author="Anna" if n > 1 else "")
        for n, study in enumerate(studies, 1)
    ]


@pytest.mark.parametrize("study", [STUDY, THIRD], ids=["paper", "three strategies"])
def test_entries_are_every_weight_and_every_cell_of_the_table(study: Study) -> None:
    found = entries(study)
    assert len(found) == (1 + 10) * len(study.scoring.strategies)
    assert found["table", "misconception_enabledness", "negation"] == 1


def test_patch_holds_only_what_differs() -> None:
    edited = {**entries(STUDY), ("table", "low", "negation"): 1.0, ("weight", "hesitation"): 0.5}
    assert patch_of(STUDY, edited) == {
        "scoring": {
            "table": {"capacity": {"low": {"negation": 1.0}}},
            "strategies": {"hesitation": {"weight": 0.5}},
        }
    }
    assert patch_of(STUDY, entries(STUDY)) == {}


def test_preview_names_exactly_the_triples_whose_state_changes() -> None:
    edited = {("table", "focused", "negation"): 1.0}
    after = patched(STUDY, patch_of(STUDY, edited))
    wanted = [
        t for t in TRIPLES if reduce(STUDY.scoring, t).cognitive_state != reduce(after.scoring, t).cognitive_state
    ]
    assert wanted
    assert [c.triple for c in state_changes(STUDY, after)] == wanted
    lines = preview(STUDY, edited)
    assert [line.split(":")[0] for line in lines] == [t.name for t in wanted]
    assert "→" in lines[0]


def test_preview_of_an_impossible_value_says_the_rule() -> None:
    assert "less than or equal to 1" in preview(STUDY, {("table", "focused", "negation"): 7.0})[0] or (
        "1" in preview(STUDY, {("table", "focused", "negation"): 7.0})[0]
    )
    assert preview(STUDY, entries(STUDY)) == ["No triple changes its cognitive state."]


def test_changes_are_listed_newest_first_and_each_can_be_undone() -> None:
    second = patched(STUDY, {"reward": {"scale": 2.0}})
    third = patched(second, {"learner": {"paused": True}})
    newest, first = changes(configs(STUDY, second, third))
    assert (newest.version, newest.differences) == (3, (("learner.paused", "false", "true"),))
    assert (first.version, first.differences) == (2, (("reward.scale", "1.0", "2.0"),))
    assert "Anna" in first.text
    undone = merge_patch(json.loads(study_json(third)), first.undo)
    assert study_from_json(json.dumps(undone)) == patched(STUDY, {"learner": {"paused": True}})
