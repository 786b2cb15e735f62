"""Readiness of services, and of the links between readers and owners."""

from __future__ import annotations

from shift_gateway.readiness import readiness
from shift_schemas.messages import Health

SERVICES = ("recorder", "monitor", "decider", "learner")
FINE: dict[str, Health | None] = {s: Health(service=s, ready=True) for s in SERVICES}
GATEWAY = Health(service="gateway", ready=True)


def cut_off(service: str, *owners: str) -> Health:
    detail = f"the {service} does not reach the {', the '.join(owners)}"
    return Health(service=service, ready=False, detail=detail, unreached=list(owners))


def test_mesh_is_ready_if_every_service_reaches_every_other() -> None:
    found = readiness(FINE, GATEWAY)
    assert (found["ready"], found["missing"], found["links"]) == (True, [], [])
    assert set(found["services"].values()) == {"ready"}


def test_pair_without_a_link_is_named_even_if_both_answer() -> None:
    found = readiness(FINE | {"monitor": cut_off("monitor", "recorder")}, GATEWAY)
    assert (found["ready"], found["missing"]) == (False, ["monitor"])
    assert found["links"] == ["the monitor does not reach the recorder"]
    assert found["services"]["monitor"] == "the monitor does not reach the recorder"


def test_service_that_answers_nobody_is_the_only_one_at_fault() -> None:
    answers = FINE | {"recorder": None, "monitor": cut_off("monitor", "recorder")}
    found = readiness(answers, cut_off("gateway", "recorder"))
    assert found["missing"] == ["recorder"]
    assert found["services"]["recorder"] == "does not answer"
    assert found["links"] == ["the monitor does not reach the recorder", "the gateway does not reach the recorder"]


def test_reason_of_a_service_that_is_not_ready_is_reported() -> None:
    waiting = Health(service="learner", ready=False, detail="waits for the decider")
    assert readiness(FINE | {"learner": waiting}, GATEWAY)["services"]["learner"] == "waits for the decider"
