"""Refusals: problem documents, their order, hostile input, and missing services."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from prometheus_client.parser import text_string_to_metric_families
from support.gateway_mesh import NEGATED, STUDY, Mesh, performance, problem, until_ready

pytestmark = pytest.mark.anyio
LEFT_OUT = (("decisions", "decision_id"), ("override", "override_id"), ("markers", "marker_id"))
"""Ids that a command may leave out."""
HOSTILE = ("**", "*", "a%2Fb", "..%2Fx", "%2e%2e", "a%00", "a%0A", "-a", "a.b", "ä", "%20", "a" * 64, "a" * 60_000)
COMMANDS: dict[str, Any] = {
    "gaze": {"source": "a", "seq": 0, "t": [0.0], "aoi": ["left"]},
    "decisions": {"task": "grasp", "decision_id": "d1"},
    "performance": performance("d1"),
    "override": {"task": "grasp", "strategy": NEGATED, "override_id": "o1"},
    "markers": {"text": "x", "marker_id": "m1"},
}
READS = ("", "observation", "policy", "config", "strategy?task=grasp", "events")
WAIT = {"study": "x", "decider": {"wait_s": 0.2}}


# --- order and ids ---


@pytest.mark.parametrize("tail", COMMANDS)
async def test_ids_are_checked_before_the_session_and_the_session_before_the_body(mesh: Mesh, tail: str) -> None:
    session = await mesh.session()
    for body in (b"{", b"x" * 300_000, json.dumps(COMMANDS[tail]).encode()):
        problem(await mesh.ask("POST", f"/v1/sessions/**/{tail}", content=body), 422)
        problem(await mesh.ask("POST", f"/v1/sessions/nobody/{tail}", content=body), 404)
    problem(await mesh.ask("POST", session.path(tail), content=b"{"), 422)
    problem(await mesh.ask("POST", session.path(tail), content=b"x" * 300_000), 413)


async def test_patch_is_checked_in_the_same_order(mesh: Mesh) -> None:
    problem(await mesh.ask("PATCH", "/v1/sessions/**/config", content=b"{"), 422)
    problem(await mesh.ask("PATCH", "/v1/sessions/nobody/config", content=b"{"), 404)


@pytest.mark.parametrize("name", HOSTILE, ids=lambda n: n[:20])
async def test_hostile_sessions_are_refused(mesh: Mesh, name: str) -> None:
    for tail in READS:
        assert problem(await mesh.ask("GET", f"/v1/sessions/{name}/{tail}".rstrip("/")), 404 if "%2F" in name else 422)
    for tail, body in COMMANDS.items():
        problem(await mesh.ask("POST", f"/v1/sessions/{name}/{tail}", body), 404 if "%2F" in name else 422)
    problem(await mesh.ask("POST", f"/v1/sessions/{name}/end"), 404 if "%2F" in name else 422)


@pytest.mark.parametrize(
    "name", ["**", "*", "a/b", "../x", "a\0", "a\n", "", "a" * 65536, None, 7, ["a"]], ids=lambda n: repr(n)[:20]
)
async def test_hostile_ids_in_bodies_are_refused_by_field(mesh: Mesh, name: Any) -> None:
    session = await mesh.session()
    for tail, field in (
        ("gaze", "source"), ("decisions", "task"), ("decisions", "decision_id"), ("performance", "decision_id"),
        ("override", "task"), ("override", "override_id"), ("markers", "marker_id"),
    ):  # fmt: skip
        if name is None and (tail, field) in LEFT_OUT:
            continue
        found = problem(await session.post(tail, COMMANDS[tail] | {field: name}), 422)
        assert [e["field"] for e in found["errors"]] == [field]


async def test_hostile_tasks_of_the_preview_are_refused(mesh: Mesh) -> None:
    session = await mesh.session()
    for task in ("**", "a/b", "", "a%00"):
        assert problem(await session.get(f"strategy?task={task}"), 422)["errors"][0]["field"] == "task"
    problem(await session.get("strategy"), 422)
    problem(await mesh.ask("GET", "/v1/sessions/nobody/strategy?task=**"), 422)


async def test_every_path_answers_404_for_an_unknown_session(mesh: Mesh) -> None:
    for tail in READS:
        assert (
            "no session nobody"
            in problem(await mesh.ask("GET", f"/v1/sessions/nobody/{tail}".rstrip("/")), 404)["detail"]
        )
    problem(await mesh.ask("POST", "/v1/sessions/nobody/end"), 404)


async def test_unknown_paths_and_methods_are_problems(mesh: Mesh) -> None:
    problem(await mesh.ask("GET", "/v1/nothing"), 404)
    problem(await mesh.ask("DELETE", "/v1/sessions"), 405)
    problem(await mesh.ask("GET", "/v1/" + "x" * 60_000), 404)


# --- bodies ---


async def pieces(total: int, size: int = 10_000, head: bytes = b"") -> AsyncIterator[bytes]:
    """Yield a body of ``total`` bytes in pieces, without a length."""
    yield head
    for _ in range(total // size):
        yield b" " * size


@pytest.mark.parametrize("tail", COMMANDS)
async def test_body_above_256_kb_is_refused_and_has_no_effect(mesh: Mesh, tail: str) -> None:
    session = await mesh.session()
    if tail == "performance":
        await session.decide(decision_id="d1")
    before = (await session.read())["counts"]
    whole = json.dumps(COMMANDS[tail]).encode()
    problem(await mesh.ask("POST", session.path(tail), content=whole + b" " * 256 * 1024), 413)
    problem(await mesh.ask("POST", session.path(tail), content=pieces(300_000, head=whole)), 413)
    assert (await session.read())["counts"] == before
    assert (await mesh.ask("POST", session.path(tail), content=pieces(200_000, head=whole))).status_code in (201, 202)


async def test_starts_patches_and_ends_have_the_same_limit(mesh: Mesh) -> None:
    session = await mesh.session()
    whole = b'{"participant":"P01","session":"toolarge"}'
    problem(await mesh.ask("POST", "/v1/sessions", content=pieces(300_000, head=whole)), 413)
    problem(await mesh.ask("GET", "/v1/sessions/toolarge"), 404)
    problem(await mesh.ask("PATCH", session.path("config"), content=pieces(300_000, head=b"{}")), 413)
    problem(await mesh.ask("POST", session.path("end"), content=pieces(300_000)), 413)
    assert (await session.read())["state"] == "live"


BAD = [
    b"", b"{", b"null", b"[]", b"1", b'"x"', b"\xff\xfe\x00", b"\x00", b"{'a':1}", b"NaN", b"[" * 50_000,
    b'{"a":' * 50_000,
    b'{"task":"grasp","task":"turn"}', b'{"task":NaN}', b'{"task":1e999}', b'{"task":' + b"9" * 10_000 + b"}",
    b'{"' + b"k" * 100_000 + b'":1}', b'{"task":"\\ud800"}', b'{"task":"' + b"x" * 200_000 + b'"}',
]  # fmt: skip


@pytest.mark.parametrize("body", BAD, ids=lambda b: ascii(b[:24]))
async def test_bad_bodies_are_problems_everywhere(mesh: Mesh, body: bytes) -> None:
    session = await mesh.session()
    for tail in COMMANDS:
        problem(await mesh.ask("POST", session.path(tail), content=body), 422)
    problem(await mesh.ask("PATCH", session.path("config"), content=body), 422)
    problem(await mesh.ask("POST", "/v1/sessions", content=body), 422)


@pytest.mark.parametrize("number", ["1e999", "-1e999", "NaN", "Infinity", "true", '"1"', "null", "[]", "{}"])
async def test_value_that_is_not_a_number_is_refused(mesh: Mesh, number: str) -> None:
    session = await mesh.session(STUDY)
    await session.decide(decision_id="d1")
    duration = json.dumps(performance("d1")).replace("5.0", number)
    problem(await mesh.ask("POST", session.path("performance"), content=duration), 422)
    for column in ("seq", "t", "x", "y"):
        if column in ("x", "y") and number == "null":
            continue
        chunk = {"source": '"a"', "seq": "0", "t": "[0]", "x": "[0.5]", "y": "[0.5]"} | {
            column: number if column == "seq" else f"[{number}]"
        }
        text = "{" + ",".join(f'"{name}":{value}' for name, value in chunk.items()) + "}"
        problem(await mesh.ask("POST", session.path("gaze"), content=text), 422)
    if number != "null":
        problem(await mesh.ask("PATCH", session.path("config"), content='{"reward":{"decay":%s}}' % number), 422)  # noqa: UP031
        study = '{"study":"x","reward":{"decay":%s}}' % number  # noqa: UP031
        problem(await mesh.ask("POST", "/v1/sessions", content='{"participant":"P","study":%s}' % study), 422)  # noqa: UP031
    assert (await session.read("config"))["version"] == 1


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=30)
    | st.sampled_from(["grasp", "d1", "robot", "negation", "a" * 5000]),
    lambda inner: st.lists(inner, max_size=4)
    | st.dictionaries(st.text(max_size=8) | st.sampled_from(["strategy", "x", "reward", "table"]), inner, max_size=4),
    max_leaves=10,
)  # fmt: skip
FIELDS = [
    "task", "decision_id", "source", "seq", "t", "x", "y", "valid", "aoi", "comprehension", "enabledness", "strategy",
    "reason", "text", "participant", "study", "seed", "condition", "scoring", "capacity", "learner", "reward",
]  # fmt: skip
QUIET = settings(deadline=None, max_examples=60, derandomize=True, suppress_health_check=list(HealthCheck))


@QUIET
@given(
    st.sampled_from([*COMMANDS, "config", "start"]),
    st.dictionaries(st.sampled_from(FIELDS), values, max_size=4),
    st.booleans(),
)
async def test_no_json_body_causes_a_server_error(mesh: Mesh, tail: str, change: dict[str, Any], bare: bool) -> None:
    session = getattr(mesh, "fuzzed", None) or await mesh.session(STUDY)
    mesh.fuzzed = session  # type: ignore[attr-defined]
    base = {} if bare else COMMANDS.get(tail, {"participant": "P01"} if tail == "start" else {})
    text = json.dumps(base | change)
    if tail == "start":
        answer = await mesh.ask("POST", "/v1/sessions", content=text)
    elif tail == "config":
        answer = await mesh.ask("PATCH", session.path("config"), content=text)
    else:
        answer = await mesh.ask("POST", session.path(tail), content=text)
    assert answer.status_code in (200, 201, 202, 404, 409, 422)
    if answer.status_code >= 400:
        problem(answer, answer.status_code)


@QUIET
@given(st.binary(max_size=200), st.sampled_from([*COMMANDS, "config"]))
async def test_no_bytes_cause_a_server_error(mesh: Mesh, body: bytes, tail: str) -> None:
    session = getattr(mesh, "fuzzed", None) or await mesh.session(STUDY)
    mesh.fuzzed = session  # type: ignore[attr-defined]
    method = "PATCH" if tail == "config" else "POST"
    problem(await mesh.ask(method, session.path(tail), content=body), 422)


# --- services that are not there ---


async def test_stopped_service_is_named(own_mesh: Mesh) -> None:
    session = await own_mesh.session(WAIT)
    await session.decide(decision_id="d1")
    for name, asks in (
        ("monitor", [("gaze", COMMANDS["gaze"])]),
        ("decider", [("decisions", {"task": "grasp", "decision_id": "d2"}), ("override", COMMANDS["override"]),
                     ("performance", performance("unheard-of"))]),
        ("learner", [("performance", performance("d1"))]),
        ("recorder", [("markers", COMMANDS["markers"])]),
    ):  # fmt: skip
        await own_mesh.stop(name)
        for tail, body in asks:
            answer = await session.post(tail, body)
            assert name in problem(answer, 503)["detail"], tail
            assert answer.headers["retry-after"] == "1"
        ready = await own_mesh.ask("GET", "/readyz")
        assert ready.status_code == 503
        assert ready.json() == ready.json() | {"ready": False, "missing": [name]}
        assert ready.json()["services"][name] == "does not answer"
        own_mesh.start(name)
        await until_ready(own_mesh)
    assert (await session.decide(decision_id="d2"))["n"] == 2
    assert (await session.report("d1"))["decision_id"] == "d1"
    assert (await session.end())["counts"]["decision"] == 2


async def test_no_session_is_called_unknown_without_the_recorder(own_mesh: Mesh) -> None:
    session = await own_mesh.session(WAIT)
    await own_mesh.stop("recorder")
    for tail in READS:
        assert (
            "recorder" in problem(await own_mesh.ask("GET", f"/v1/sessions/nobody/{tail}".rstrip("/")), 503)["detail"]
        )
    for tail, body in COMMANDS.items():
        problem(await own_mesh.ask("POST", f"/v1/sessions/nobody/{tail}", body), 503)
    problem(await own_mesh.ask("POST", "/v1/sessions", {"participant": "P01"}), 503)
    problem(await session.configure({"reward": {"scale": 2}}), 503)
    assert (await session.decide())["n"] == 1, "a known session continues"
    assert [s["session"] for s in (await own_mesh.ask("GET", "/v1/sessions")).json()["sessions"]] == [session.name]


async def test_decisions_without_the_monitor_are_stale(own_mesh: Mesh) -> None:
    session = await own_mesh.session(WAIT)
    await session.decide()
    await session.read("observation")
    await own_mesh.stop("monitor")
    await session.decide()
    third = await session.decide()
    assert (third["stale"], third["policy_source"], third["n"]) == (True, "learner", 3)
    assert "monitor" in problem(await session.get("observation"), 503)["detail"]
    shown = await session.read("strategy?task=grasp")
    assert (shown["stale"], shown["n"]) == (True, 4)


async def test_decisions_without_the_learner_use_the_last_policy(own_mesh: Mesh) -> None:
    session = await own_mesh.session(WAIT)
    await session.decide()
    await session.read("policy")
    await own_mesh.stop("learner")
    await session.decide()
    third = await session.decide()
    assert (third["stale"], third["policy_source"]) == (False, "last_policy")
    assert "learner" in problem(await session.get("policy"), 503)["detail"]
    own_mesh.start("learner")
    await until_ready(own_mesh)
    assert (await session.read("policy"))["for_n"] == 4
    assert (await session.decide())["policy_source"] == "learner"


async def test_scoring_system_decides_before_the_first_policy(own_mesh: Mesh) -> None:
    await own_mesh.stop("learner")
    session = await own_mesh.session(WAIT)
    decision = await session.decide()
    assert (decision["policy_source"], decision["strategy"]) == ("scoring", decision["suggested"])


async def test_new_gateway_reads_the_journals(own_mesh: Mesh) -> None:
    live, over = await own_mesh.session(WAIT), await own_mesh.session(WAIT)
    for session in (live, over):
        await session.decide(decision_id="d1")
        await session.report("d1")
    ended = await over.end()
    before = {tail: await live.read(tail) for tail in ("", "observation", "policy", "config", "strategy?task=grasp")}
    policy = await over.read("policy")
    app = own_mesh.app
    async with app.router.lifespan_context(app):  # the same paths over a read model that has read nothing yet
        for tail, shown in before.items():
            assert await live.read(tail) == shown
        assert (await over.read())["counts"] == ended["counts"]
        assert await over.read("policy") == policy
        assert await live.report("d1")
        assert (await live.decide())["n"] == 2


async def test_end_without_a_service_fails_and_can_be_repeated(own_mesh: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shift_recorder.service.convergence.END_WAIT_S", 0.1)
    session = await own_mesh.session(WAIT)
    await own_mesh.stop("learner")
    assert "learner" in problem(await session.post("end"), 503)["detail"]
    problem(await session.post("markers", COMMANDS["markers"]), 409)
    assert (await session.read())["state"] == "ending"
    own_mesh.start("learner")
    await until_ready(own_mesh)
    assert (await session.end())["state"] == "ended"


# --- operations ---


async def test_process_is_up_and_every_service_is_ready(mesh: Mesh) -> None:
    assert (await mesh.ask("GET", "/healthz")).status_code == 200
    ready = (await mesh.ask("GET", "/readyz")).json()
    assert (ready["ready"], ready["missing"]) == (True, [])
    assert set(ready["services"].values()) == {"ready"}
    assert set(ready["services"]) == {"recorder", "monitor", "decider", "learner", "gateway"}


async def test_metrics_include_all_services(mesh: Mesh) -> None:
    answer = await mesh.ask("GET", "/metrics")
    assert answer.headers["content-type"].startswith("text/plain; version=0.0.4")
    families = {f.name: f for f in text_string_to_metric_families(answer.text)}
    dropped = families["shift_messages_dropped"].samples
    assert {s.name for s in dropped if not s.name.endswith("_created")} == {"shift_messages_dropped_total"}
    assert {s.labels["service"] for s in dropped} == {"recorder", "monitor", "decider", "learner", "gateway"}
    assert {s.labels["reason"] for s in dropped} >= {"malformed", "refused", "overload"}
    names = [f.name for f in text_string_to_metric_families(answer.text)]
    assert len(names) == len(set(names)), "a family once"


async def test_openapi_document_has_every_path(mesh: Mesh) -> None:
    document = (await mesh.ask("GET", "/openapi.json")).json()
    paths = {(method.upper(), path) for path, methods in document["paths"].items() for method in methods}
    one = "/v1/sessions/{session}"
    assert paths >= {
        ("POST", "/v1/sessions"), ("GET", "/v1/sessions"), ("GET", one), ("POST", f"{one}/end"),
        ("POST", f"{one}/gaze"), ("POST", f"{one}/decisions"), ("GET", f"{one}/strategy"),
        ("POST", f"{one}/performance"),
        ("GET", f"{one}/observation"),
        ("GET", f"{one}/policy"),
        ("GET", f"{one}/config"), ("PATCH", f"{one}/config"), ("POST", f"{one}/override"),
        ("POST", f"{one}/markers"), ("GET", f"{one}/events"), ("GET", "/v1/recordings"),
        ("GET", "/v1/recordings/{name}"),
        ("GET", "/healthz"), ("GET", "/readyz"), ("GET", "/metrics"),
    }  # fmt: skip
    body = document["paths"][f"{one}/decisions"]["post"]["requestBody"]["content"]["application/json"]["schema"]
    assert body["properties"]["task"]["pattern"] == "^[A-Za-z0-9][A-Za-z0-9_-]{0,62}$"
    assert set(document["paths"][f"{one}/config"]["patch"]["requestBody"]["content"]) == {
        "application/json", "application/merge-patch+json",
    }  # fmt: skip
    assert "$ref" not in json.dumps(document["paths"]), "each is whole"
    for methods in document["paths"].values():
        for operation in methods.values():
            assert set(operation["responses"]["default"]["content"]) == {"application/problem+json"}
            assert "422" not in operation["responses"], "the framework's own document is never answered"


async def test_documentation_is_html(mesh: Mesh) -> None:
    answer = await mesh.ask("GET", "/docs")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/html")


async def test_simultaneous_reads_are_all_answered(mesh: Mesh) -> None:
    session = await mesh.session()
    answers = await asyncio.gather(
        *(session.read("observation") for _ in range(20)), *(session.read("policy") for _ in range(20))
    )
    assert len({json.dumps(a) for a in answers[:20]}) == 1
