"""The paths of the commands: each declared command with a route has its path, its body and its owner."""

from __future__ import annotations

import itertools
import string
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field
from shift_gateway.command_paths import add_commands
from shift_gateway.gateway import Gateway
from shift_gateway.settings import GatewaySettings
from shift_runtime.mesh_api import MeshApi
from shift_runtime.read_model import SessionView
from shift_schemas.ids import Id
from shift_schemas.messages import Answer, Command, RestRoute, Seen, Session
from shift_schemas.registry import COMMANDS
from shift_schemas.requests import body_type
from shift_schemas.timestamps import Stamp
from support.gateway_mesh import Mesh

pytestmark = pytest.mark.anyio
numbers = itertools.count()
names = st.text(string.ascii_lowercase, max_size=12).map(lambda name: f"{name}_path_{next(numbers)}")
"""Each name is used once in the test run: a declared class lives until it is collected."""


def declared(name: str, owner: str, method: str, status: int) -> type[Command]:
    """Return a new command with a route, declared as a message file would declare it."""

    class Wave(Command):
        """Wave at somebody."""

        whom: Id = Field(description="Who is waved at.")
        times: int = 1
        found: str = ""

    Wave.owner, Wave.procedure = owner, name
    Wave.route = RestRoute(method, f"/v1/sessions/{{session}}/{name}", status)  # type: ignore[arg-type]
    Wave.id_field, Wave.id_prefix, Wave.internal = "wave_id", "w-", frozenset({"found"})
    return Wave


@given(
    names, st.sampled_from(["recorder", "monitor", "decider", "learner"]), st.sampled_from(["POST", "PATCH"]),
    st.sampled_from([200, 201]),
)  # fmt: skip
def test_declared_command_has_a_path_with_its_body(name: str, owner: str, method: str, status: int) -> None:
    kind = declared(name, owner, method, status)
    app = FastAPI()
    add_commands(app, Gateway(GatewaySettings(data=Path("nowhere"))), [*COMMANDS.values(), kind])
    operation = app.openapi()["paths"][f"/v1/sessions/{{session}}/{name}"][method.lower()]
    assert operation["description"] == "Wave at somebody."
    assert str(status) in operation["responses"]
    schema = operation["requestBody"]["content"]["application/json"]["schema"]
    assert list(schema["properties"]) == ["whom", "times", "wave_id"]
    assert schema["required"] == ["whom"]
    assert schema["properties"]["whom"]["description"] == "Who is waved at."


@pytest.mark.parametrize("kind", [kind for kind in COMMANDS.values() if kind.route], ids=lambda kind: kind.procedure)
async def test_each_route_is_in_the_application(mesh: Mesh, kind: type[Command]) -> None:
    assert kind.route is not None
    operation = mesh.app.openapi()["paths"][kind.route.path][kind.route.method.lower()]
    assert operation["tags"] == [kind.route.tag]
    assert set(operation.get("requestBody", {"content": {}})["content"]) == set(kind.route.media_types)


class FakeMesh:
    """A client of the mesh that answers every command and remembers it."""

    def __init__(self) -> None:
        self.commands: list[Command] = []

    async def command(self, command: Command, wait_s: float) -> Answer:
        """Remember the command and answer it."""
        self.commands.append(command)
        return Answer(owner=command.owner, seq=1, result={"waved": True})


class FakeReadModel:
    """A read model with one session."""

    def __init__(self, view: Any) -> None:
        self.views = {"s1": view}

    async def view(self, session: str) -> Any:
        """Return the session's view."""
        return self.views[session]


@given(names, st.none() | st.just("w1"))
async def test_declared_command_is_carried_out_with_the_id_that_was_given(name: str, wave_id: str | None) -> None:
    kind = declared(name, "decider", "POST", 201)
    mesh = FakeMesh()
    api = MeshApi(mesh, FakeReadModel(new_session_view()))  # type: ignore[arg-type]
    body = body_type(kind)(whom="P01", times=3, wave_id=wave_id)
    assert await api.command(kind, "s1", body) == ({"waved": True}, False)
    (command,) = mesh.commands
    assert type(command) is kind
    assert command.command_id == wave_id if wave_id else command.command_id.startswith("w-")
    assert command.model_dump(include={"session", "whom", "times", "found"}) == {
        "session": "s1", "whom": "P01", "times": 3, "found": "",
    }  # fmt: skip
    assert command.need == Seen(config=1), "it requires what was answered before"


def new_session_view() -> SessionView:
    """Return the view of a session that has just begun."""
    now = Stamp.of(0)
    fact = Session(session="s1", stamp=now, participant="P01", study="x", seed=1, state="live", started=now)
    return SessionView(fact)
