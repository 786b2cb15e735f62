"""Sessions, configuration and recordings over REST, field by field."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from io import BytesIO
from typing import Any

import pytest
from mcap.reader import make_reader
from support.gateway_mesh import START_NS, STUDY, Mesh

pytestmark = pytest.mark.anyio


# --- start ---


async def test_start_answers_with_the_session(mesh: Mesh) -> None:
    body = {"participant": "P01", "session": "fields", "study": "coffee", "seed": 7, "condition": "adaptive"}
    answer = await mesh.ask("POST", "/v1/sessions", body)
    assert answer.status_code == 201
    expected = {
        "session": "fields", "participant": "P01", "study": "coffee", "condition": "adaptive", "seed": 7,
        "state": "live", "started": {"sec": START_NS // 10**9, "nsec": 0},
    }  # fmt: skip
    assert answer.json().items() >= expected.items()
    assert (await mesh.ask("GET", "/v1/sessions/fields")).json().items() >= expected.items()


async def test_defaults_are_a_new_id_the_default_study_and_a_seed_of_the_id(mesh: Mesh) -> None:
    first = (await mesh.ask("POST", "/v1/sessions", {"participant": "P01"})).json()
    second = (await mesh.ask("POST", "/v1/sessions", {"participant": "P01"})).json()
    assert first["session"] != second["session"]
    for answer in (first, second):
        assert (answer["study"], answer["condition"]) == ("default", None)
        digest = hashlib.sha256(answer["session"].encode()).digest()
        assert answer["seed"] == int.from_bytes(digest[:6], "big"), "a restart gives the same"


async def test_covariates_are_kept_as_text(mesh: Mesh) -> None:
    given = {"age": 31, "group": "a", "height_m": 1.62, "left_handed": True}
    body = {"participant": "P01", "session": "people", "covariates": given}
    answer = await mesh.ask("POST", "/v1/sessions", body)
    assert answer.status_code == 201
    expected = {"age": "31", "group": "a", "height_m": "1.62", "left_handed": "true"}
    assert answer.json()["covariates"] == expected
    assert (await mesh.ask("GET", "/v1/sessions/people")).json()["covariates"] == expected
    assert (await mesh.ask("POST", "/v1/sessions", body)).status_code == 200
    assert (await mesh.ask("POST", "/v1/sessions", body | {"covariates": {"age": 32}})).status_code == 409


@pytest.mark.parametrize(
    ("covariates", "says"),
    [({"participant": "P02"}, "is a column of the exported table already"), ({"a b": "x"}, "covariates"),
     ({"age": None}, "age"), ({"age": {"years": 31}}, "age"), ({"note": "x" * 201}, "200"),
     ({f"c{i}": "x" for i in range(33)}, "32")],
    ids=lambda value: str(value)[:20],
)  # fmt: skip
async def test_wrong_covariates_are_refused(mesh: Mesh, covariates: dict[str, Any], says: str) -> None:
    answer = await mesh.ask("POST", "/v1/sessions", {"participant": "P01", "covariates": covariates})
    assert answer.status_code == 422
    assert says in answer.text


async def test_repeated_start_gets_the_first_result(mesh: Mesh) -> None:
    body = {"participant": "P01", "session": "again", "study": STUDY}
    first = await mesh.ask("POST", "/v1/sessions", body)
    again = await mesh.ask("POST", "/v1/sessions", body)
    assert (first.status_code, again.status_code) == (201, 200)
    assert first.json() == again.json()


@pytest.mark.parametrize(
    "change", [{"participant": "P02"}, {"study": "coffee"}, {"seed": 8}, {"condition": "control"}], ids=str
)
async def test_used_session_with_another_content_is_a_conflict(mesh: Mesh, change: dict[str, Any]) -> None:
    session = await mesh.session(STUDY)
    body = {"participant": "P01", "session": session.name, "study": STUDY, "seed": 7}
    assert (await mesh.ask("POST", "/v1/sessions", body)).status_code == 200
    answer = await mesh.ask("POST", "/v1/sessions", body | change)
    assert answer.status_code == 409


async def test_study_object_and_its_condition_are_in_force(mesh: Mesh) -> None:
    control = await mesh.session(STUDY, condition="control")
    config = await control.read("config")
    assert (config["study"], config["learner"]["name"], config["version"]) == ("mine", "scoring", 1)
    assert config["learner"]["epsilon"] == 0.75, "every default is written out"
    assert (await control.read("policy"))["learner"] == "scoring"
    adaptive = await mesh.session(STUDY, condition="adaptive")
    assert (await adaptive.read("policy"))["learner"] == "q-learning"


@pytest.mark.parametrize(
    ("change", "field", "says"),
    [({"study": "nobody"}, "study", "there are coffee, coffee_de, default"),
     ({"condition": "x"}, "condition", "control, adaptive"),
     ({"study": {**STUDY, "reward": {"decay": -1}}}, "reward.decay", "it must be at least 0"),
     ({"study": {**STUDY, "rewrad": {}}}, "rewrad", "write 'reward'"), ({"study": {}}, "study", "missing"),
     ({"study": 7}, "study", "valid"), ({"study": "../x"}, "study", "for example x"), ({"seed": -1}, "seed", "greater"),
     ({"seed": 2**53}, "seed", "less than"), ({"seed": 1.5}, "seed", "integer"), ({"seed": True}, "seed", "integer"),
     ({"participant": "a/b"}, "participant", "for example a-b"), ({"session": "**"}, "session", "'**' is not an id"),
     ({"participant": None}, "participant", "valid string"), ({"color": "red"}, "color", "not permitted")],
    ids=str,
)  # fmt: skip
async def test_invalid_start_is_refused_by_field(mesh: Mesh, change: dict[str, Any], field: str, says: str) -> None:
    answer = await mesh.ask("POST", "/v1/sessions", {"participant": "P01", "study": STUDY, **change})
    assert answer.status_code == 422
    found = next(e for e in answer.json()["errors"] if e["field"] == field)
    assert says in found["rule"]


async def test_study_of_the_data_folder_is_found_by_its_name(mesh: Mesh) -> None:
    (mesh.data / "studies").mkdir(exist_ok=True)
    (mesh.data / "studies" / "own.yaml").write_text("study: own\ntasks: [dig]\n")
    (mesh.data / "studies" / "broken.yaml").write_text("study: broken\nreward:\n  decay: fast\n")
    session = await mesh.session("own")
    assert (await session.read("config"))["tasks"] == ["dig"]
    answer = await mesh.ask("POST", "/v1/sessions", {"participant": "P01", "study": "broken"})
    assert answer.status_code == 422
    assert answer.json()["detail"].startswith("broken.yaml:3: reward.decay: 'fast'")


# --- reading sessions ---


async def test_every_session_is_listed_with_its_counts(mesh: Mesh) -> None:
    one, two = await mesh.session(), await mesh.session()
    await one.decide()
    await one.done("markers", {"text": "hello"})
    listed = {s["session"]: s for s in (await mesh.ask("GET", "/v1/sessions")).json()["sessions"]}
    assert listed[one.name]["counts"]["decision"] == listed[one.name]["counts"]["marker"] == 1
    assert "decision" not in listed[two.name]["counts"]
    assert (await one.read())["counts"]["decision"] == 1
    assert (await two.read())["state"] == "live"


# --- configuration ---


@pytest.mark.parametrize("media", ["application/json", "application/merge-patch+json"])
async def test_merge_patch_changes_the_study_in_force(mesh: Mesh, media: str) -> None:
    session = await mesh.session(STUDY)
    before = await session.read("config")
    patch = {"reward": {"scale": 2.0}, "scoring": {"strategies": {"negation": {"weight": 1.25}}}}
    answer = await mesh.ask("PATCH", session.path("config"), content=json.dumps(patch), headers={"content-type": media})
    assert answer.status_code == 200
    after = answer.json()
    assert after["version"] == 2
    assert after["reward"] == before["reward"] | {"scale": 2.0}
    assert after["scoring"]["strategies"]["negation"]["weight"] == 1.25
    assert await session.read("config") == after
    decision = await session.decide()
    assert decision["versions"]["config"] == 2
    assert decision["scores"]["negation"] == pytest.approx(1.25 * 2 / 3), "high capacity, no gaze yet"
    assert (await session.report(decision["decision_id"], seconds=0.0))["reward"] == 2.0


async def test_null_restores_the_default(mesh: Mesh) -> None:
    session = await mesh.session(STUDY | {"reward": {"decay": 0.2}})
    assert (await session.configure({"reward": None})).json()["reward"] == {"decay": 0.1, "scale": 1.0}


async def test_whole_configuration_can_be_sent_back_as_it_was_read(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    config = await session.read("config")
    config["decider"]["wait_s"] = 3.0
    answer = await session.configure(config)
    assert answer.status_code == 200
    assert (answer.json()["decider"]["wait_s"], answer.json()["version"]) == (3.0, 2)
    stale = await session.configure(config)
    assert stale.status_code == 422
    assert stale.json()["errors"][0]["field"] == "version"


@pytest.mark.parametrize(
    ("patch", "names"),
    [({"study": "other"}, ["study"]), ({"title": "t"}, ["title"]), ({"tasks": ["x"]}, ["tasks"]),
     ({"tasks": None}, ["tasks"]),
     ({"aois": None}, ["aois"]), ({"conditions": {"new": {}}}, ["conditions"]),
     ({"interactions": 50}, ["interactions"]),
     ({"fixation": {"distance_cm": 60}}, ["fixation"]), ({"learner": {"name": "scoring"}}, ["learner.name"]),
     ({"scoring": {"strategies": {"hesitation": None}}}, ["scoring.strategies"]), ({"version": 9}, ["version"]),
     ({"scoring": {"strategies": {"hesitation": {"levels": ["a", "b"]}}}}, ["scoring.strategies.hesitation.levels"]),
     ({"interactions": 9, "title": "t", "reward": {"scale": 2}}, ["title", "interactions"])],
    ids=str,
)  # fmt: skip
async def test_change_of_a_fixed_value_is_refused_by_name_and_has_no_effect(
    mesh: Mesh, patch: dict[str, Any], names: list[str]
) -> None:
    session = await mesh.session(STUDY)
    before = await session.read("config")
    answer = await session.configure(patch)
    assert answer.status_code == 422
    assert [e["field"] for e in answer.json()["errors"]] == names
    assert await session.read("config") == before


@pytest.mark.parametrize(
    "patch",
    [[], 1, None, "x", {"reward": {"decay": -1}}, {"reward": {"zzz": 1}}, {"zzz": 1}, {"reward": 5}, {"study": None}],
    ids=str,
)
async def test_invalid_patch_is_refused(mesh: Mesh, patch: Any) -> None:
    session = await mesh.session(STUDY)
    answer = await mesh.ask("PATCH", session.path("config"), content=json.dumps(patch))
    assert answer.status_code == 422
    assert answer.json()["errors"]
    assert (await session.read("config"))["version"] == 1


# --- the end, and recordings ---


async def test_end_answers_with_the_finished_recording(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    decision = await session.decide()
    await session.look(["robot", "cup", None])
    await session.report(decision["decision_id"])
    await session.done("markers", {"text": "note"})
    ended = await session.end()
    assert {k: ended[k] for k in ("session", "state", "recording")} == {
        "session": session.name, "state": "ended", "recording": f"{session.name}.mcap",
    }  # fmt: skip
    assert ended["counts"]["decision"] == ended["counts"]["performance"] == ended["counts"]["transition"] == 1
    assert ended["counts"]["gaze"] == ended["counts"]["marker"] == 1
    file = await mesh.ask("GET", f"/v1/recordings/{ended['recording']}")
    assert file.status_code == 200
    assert hashlib.sha256(file.content).hexdigest() == ended["sha256"]
    checksum = await mesh.ask("GET", f"/v1/recordings/{ended['recording']}.sha256")
    assert checksum.text.split() == [ended["sha256"], ended["recording"]]
    assert await session.end() == ended, "the same end again gets the first result"
    shown = await session.read()
    assert {k: shown[k] for k in ended} == ended
    assert shown["ended"] == {"sec": START_NS // 10**9, "nsec": 0}


async def test_recording_has_the_counted_messages(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    await session.decide()
    ended = await session.end()
    stream = BytesIO((mesh.data / "recordings" / ended["recording"]).read_bytes())
    counted = Counter(channel.topic for _, channel, _ in make_reader(stream, validate_crcs=True).iter_messages())
    assert counted == {topic: n for topic, n in ended["counts"].items() if n}


async def test_recordings_are_listed(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    await session.end()
    listed = {r["name"]: r for r in (await mesh.ask("GET", "/v1/recordings")).json()["recordings"]}
    found = listed[f"{session.name}.mcap"]
    stamp = {"sec": START_NS // 10**9, "nsec": 0}
    assert found == {
        "name": f"{session.name}.mcap", "session": session.name, "participant": "P01", "started": stamp, "ended": stamp,
        "bytes": (mesh.data / "recordings" / f"{session.name}.mcap").stat().st_size,
    }  # fmt: skip


@pytest.mark.parametrize(
    "name", ["nobody.mcap", "x", "..%2Fstate%2Frecorder.sqlite", "%2e%2e.mcap", "a%00.mcap", "**.mcap", ".mcap"]
)
async def test_missing_recording_is_404(mesh: Mesh, name: str) -> None:
    answer = await mesh.ask("GET", f"/v1/recordings/{name}")
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"


async def test_ended_session_accepts_no_input_and_can_be_read(mesh: Mesh) -> None:
    session = await mesh.session(STUDY)
    decision = await session.decide(decision_id="d1")
    reported = await session.report("d1")
    before = {tail: await session.read(tail) for tail in ("policy", "config")}
    await session.end()
    for tail, body in (
        ("gaze", {"source": "a", "seq": 0, "t": [0.0], "aoi": ["robot"]}), ("decisions", {"task": "grasp"}),
        ("override", {"task": "grasp", "strategy": decision["strategy"]}), ("markers", {"text": "late"}),
    ):  # fmt: skip
        answer = await session.post(tail, body)
        assert answer.status_code == 409, tail
        assert "has ended" in answer.json()["detail"]
    assert (await session.configure({"reward": {"scale": 2}})).status_code == 409
    assert (await session.get("strategy?task=grasp")).status_code == 409
    assert await session.decide(decision_id="d1") == decision, "a repeat always gets the first result"
    assert await session.report("d1") == reported
    for tail, shown in before.items():
        assert await session.read(tail) == shown
    assert (await session.read("observation"))["session"] == session.name


async def test_start_without_a_condition_gets_a_warning_if_the_study_has_conditions(mesh: Mesh) -> None:
    study = {"study": "x", "conditions": {"control": {"learner": {"name": "scoring"}}, "adaptive": {}}}
    body = {"participant": "P01", "study": study}
    answer = await mesh.http.post("/v1/sessions", json=body)
    assert answer.status_code == 201
    assert any("conditions control, adaptive and none was chosen" in w for w in answer.json()["warnings"])
    chosen = await mesh.http.post("/v1/sessions", json=body | {"condition": "adaptive"})
    assert chosen.json()["warnings"] == []
    refused = await mesh.http.post("/v1/sessions", json=body | {"study": study | {"require_condition": True}})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "condition"
    assert "one of: control, adaptive" in refused.json()["detail"]
    nonsense = await mesh.http.post("/v1/sessions", json=body | {"study": {"study": "x", "require_condition": True}})
    assert nonsense.status_code == 422


async def test_start_of_a_doubtful_study_gets_its_warnings(mesh: Mesh) -> None:
    study = {"study": "x", "fixation": {"distance_cm": 650}}
    answer = await mesh.http.post("/v1/sessions", json={"participant": "P01", "study": study})
    assert answer.status_code == 201
    assert any("fixation.distance_cm is 650" in warning for warning in answer.json()["warnings"])
