"""``/readyz`` is about pairs as well: every reader reaches every owner that it reads."""

from __future__ import annotations

from shift_gateway.readiness import readiness
from shift_schemas.messages import Health

SERVICES = ("recorder", "monitor", "decider", "learner")
FINE: dict[str, Health | None] = {s: Health(service=s, ready=True) for s in SERVICES}
GATEWAY = Health(service="gateway", ready=True)


def cut_off(service: str, *owners: str) -> Health:
    detail = f"the {service} does not reach the {', the '.join(owners)}"
    return Health(service=service, ready=False, detail=detail, unreached=list(owners))


def test_everybody_answers_and_reaches_everybody() -> None:
    found = readiness(FINE, GATEWAY)
    assert (found["ready"], found["missing"], found["links"]) == (True, [], [])
    assert set(found["services"].values()) == {"ready"}


def test_a_pair_that_does_not_reach_each_other_is_named_though_both_answer() -> None:
    found = readiness(FINE | {"monitor": cut_off("monitor", "recorder")}, GATEWAY)
    assert (found["ready"], found["missing"]) == (False, ["monitor"])
    assert found["links"] == ["the monitor does not reach the recorder"]
    assert found["services"]["monitor"] == "the monitor does not reach the recorder"


def test_a_service_that_answers_nobody_is_at_fault_and_not_those_who_miss_it() -> None:
    answers = FINE | {"recorder": None, "monitor": cut_off("monitor", "recorder")}
    found = readiness(answers, cut_off("gateway", "recorder"))
    assert found["missing"] == ["recorder"]
    assert found["services"]["recorder"] == "does not answer"
    assert found["links"] == ["the monitor does not reach the recorder", "the gateway does not reach the recorder"]


def test_what_a_service_waits_for_is_told() -> None:
    waiting = Health(service="learner", ready=False, detail="waits for the decider")
    assert readiness(FINE | {"learner": waiting}, GATEWAY)["services"]["learner"] == "waits for the decider"
