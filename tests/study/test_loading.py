"""Study files as text: what YAML can go wrong with, said in a sentence with file and line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shift_schemas.errors import InvalidStudy
from shift_study.loading import parse_study, study_of
from shift_study.yaml_reader import LARGEST
from support.message_strategies import json_values


def refusal(text: str) -> str:
    """What is said of a study file."""
    with pytest.raises(InvalidStudy) as refused:
        parse_study(text, "mine.yaml")
    assert len(refused.value.detail) < 12_000
    assert all(len(e.field) <= 80 and len(e.value) <= 80 and len(e.rule) <= 400 for e in refused.value.errors)
    return refused.value.detail


@pytest.mark.parametrize(
    ("text", "says"),
    [("study: x\nlearner: {learning_rat: 0}", "mine.yaml:2: learner.learning_rat: 'learning_rat' is not a key"),
     ("study: x\nlearner: {learning_rat: 0}", "write 'learning_rate'"),
     ("study: x\ncapcity: {}", "mine.yaml:2: capcity: 'capcity' is not a key here; write 'capacity'"),
     ("study: x\nzzz: 1", "write one of aois, attention,"),
     ("study: x\nscoring:\n  strategies:\n    negation:\n      wieght: 2", "'wieght' is not a key here; write 'wei"),
     ("study: x\nscoring:\n  strategies:\n    negation:\n      wieght: 2", "mine.yaml:5: scoring.strategies.neg"),
     ("study: x\naois:\n- nme: a", "mine.yaml:3: aois.0.nme: 'nme' is not a key here; write 'name'"),
     ("study: x\ntitle: a\ntitle: b", "mine.yaml:3: title: it is given twice, first in line 2"),
     ("study: x\nlearner:\n  epsilon: 1\n  epsilon: 0", "mine.yaml:4: learner.epsilon: it is given twice, first"),
     ('{"study": "x",\n "study": "y"}', "mine.yaml:2: study: it is given twice, first in line 1"),
     ("title: no name", "mine.yaml:1: study: it is missing; write it"),
     ("", "mine.yaml:1: a study is a mapping and the file is empty; begin with 'study: my-study'"),
     ("[1, 2]", "mine.yaml:1: a study is a mapping"), ("coffee", "mine.yaml:1: a study is a mapping"),
     ("study: [x", "mine.yaml:1: this is not YAML: "), ("study: x\n  title: y", "mine.yaml:2: this is not YAML: "),
     ("study: x\n\ttitle: y", "mine.yaml:2: this is not YAML: "),
     ("study: x\n---\nstudy: y", "mine.yaml:2: --- begins a second study"),
     ("study: \0", "mine.yaml:1: this is not YAML: it has a character that no text has"),
     ("study: *nobody", "this is not YAML"),
     ("study: !!python/object:os.system x", "mine.yaml:1: study: the tag tag:yaml.org,2002:python/obj"),
     ("? [a, b]\n: 1\nstudy: x", "mine.yaml:1: a key is a word; write name: value"),
     ("study: x\nreward: {decay: .nan}", "mine.yaml:2: reward.decay: 'nan' is not valid: input should be a finite n"),
     ("study: x\nreward: {decay: -.inf}", "finite number"), ("study: x\nreward: {decay: 1.0e+999}", "finite number"),
     ("study: x\ninteractions: " + "9" * 3000, "interactions: '99999"),
     ("study: x\nreward: 5", "mine.yaml:2: reward: '5' is not valid: it has entries of its own; write {decay: ...}"),
     ("study: x\nscoring: {strategies: 5}", "mine.yaml:2: scoring.strategies: '5'"),
     ("study: x\nscoring: 5", "mine.yaml:2: scoring"),
     ("study: x\n" + "z" * 900 + ": 1", "is not a key here"), ("{" * 5000, "this is not YAML"),
     ("study: x\ntitle: &a [*a]", "nested too deep, or an anchor contains itself")],
    ids=lambda t: ascii(t)[:40],
)  # fmt: skip
def test_a_mistake_is_said_with_file_and_line(text: str, says: str) -> None:
    assert says in refusal(text)


def test_every_mistake_is_said_at_once() -> None:
    said = refusal("study: x\nreward: {decay: -1}\nlearner: {epsilon: 2, name: deep}\n")
    assert "mine.yaml:2: reward.decay" in said
    assert "mine.yaml:3: learner.epsilon" in said
    assert "mine.yaml:3: learner.name" in said


def test_a_few_lines_cannot_spell_billions() -> None:
    laughs = "a0: &a0 [x, x]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12))
    assert f"more than {LARGEST} entries" in refusal(laughs + "study: x")


def test_a_few_lines_cannot_merge_billions() -> None:
    merges = "a0: &a0 {}\n" + "".join(f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}\n" for i in range(1, 12))
    assert f"more than {LARGEST} entries" in refusal(merges + "study: x")


def test_an_alias_is_what_it_stands_for() -> None:
    study = parse_study("study: x\nreward: &r {decay: 0.2}\nconditions: {same: {reward: *r}}")
    assert study.conditions == {"same": {"reward": {"decay": 0.2}}}


@given(st.text(max_size=80) | st.text(st.sampled_from("study: x\n{}[],&*!?-#|>'\"tiler0."), max_size=60))
def test_any_text_is_a_study_or_refused_as_one(text: str) -> None:
    try:
        parse_study(text)
    except InvalidStudy:
        return


@given(st.dictionaries(st.sampled_from(["study", "scoring", "capacity", "aois", "conditions", "tasks"]), json_values))
def test_any_object_is_a_study_or_refused_as_one(data: dict[str, object]) -> None:
    try:
        study_of({"study": "x"} | data)
    except InvalidStudy:
        return


@pytest.mark.parametrize("number", ["1e-05", "1E-5", "1.0e-05", "0.00001"])
def test_a_number_may_be_written_as_json_writes_it(number: str) -> None:
    assert parse_study(f"study: s\nreward: {{decay: {number}}}\n").reward.decay == 1e-05
