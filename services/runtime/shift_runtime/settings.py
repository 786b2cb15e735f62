"""The settings of every process, read once at its start from flags, the environment (``SHIFT_...``) or defaults."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict
from shift_schemas.errors import InvalidSettings, field_errors
from shift_schemas.shards import MOST_SHARDS, Shard, parse_shard
from shift_schemas.suggestions import did_you_mean

from shift_runtime.endpoints import parse_endpoint

DEFAULT_ROUTER = "tcp/127.0.0.1:7447"
K = TypeVar("K", bound="MeshSettings")
LOG_LEVELS = ("debug", "info", "warning", "error")
_OTHER_NAMES = {"warn": "warning", "fatal": "error", "critical": "error"}
"""The names of log levels in ROS 2 and in Python's logging."""


def _log_level(value: object) -> object:
    name = value.strip().lower() if isinstance(value, str) else value
    level = _OTHER_NAMES.get(name, name) if isinstance(name, str) else name
    if level not in LOG_LEVELS:
        raise ValueError(f"write one of {', '.join(LOG_LEVELS)}{did_you_mean(value, LOG_LEVELS)}")
    return level


def _endpoint(text: str) -> str:
    if text:
        try:
            parse_endpoint(text)
        except InvalidSettings as e:
            raise ValueError(e.detail.partition(": ")[2]) from e
    return text


def _shard(value: object) -> object:
    return parse_shard(value) if isinstance(value, str) else value


LogLevel = Annotated[Literal["debug", "info", "warning", "error"], BeforeValidator(_log_level)]
Endpoint = Annotated[str, AfterValidator(_endpoint)]


class MeshSettings(BaseSettings):
    """The settings of every process of the mesh."""

    model_config = SettingsConfigDict(env_prefix="SHIFT_", frozen=True, extra="ignore")

    zenoh: Endpoint = Field(default=DEFAULT_ROUTER, description="Endpoint of the router of the mesh.")
    listen: Endpoint = Field(
        default="tcp/127.0.0.1:0",
        description="Endpoint at which this process accepts direct links; empty: everything goes through the router.",
    )
    data: Path = Field(default=Path("data"), description="Folder of recordings, studies and journals.")
    log_level: LogLevel = Field(default="info", description="debug, info, warning or error.")
    log_json: bool = Field(default=False, description="Logs as JSON lines.")


class ServiceSettings(MeshSettings):
    """The settings of monitor, decider, learner and recorder."""

    shard: Annotated[Shard, NoDecode, BeforeValidator(_shard)] = Field(
        default=Shard(),
        description="The shard of this worker: its number, from 0, and the number of shards (0/4).",
    )


class ClientSettings(MeshSettings):
    """The settings of the processes that use the services of every shard."""

    shards: int = Field(default=1, ge=1, le=MOST_SHARDS, description="The number of shards of the mesh.")


def read_settings(kind: type[K] = MeshSettings, **given: object) -> K:  # type: ignore[assignment]
    """Return the settings; ``given`` (flags) overrides the environment. Raise :class:`InvalidSettings`."""
    try:
        return kind(**{k: v for k, v in given.items() if v is not None})  # type: ignore[arg-type]
    except ValidationError as e:
        errors = field_errors(e)
        said = "; ".join(
            f"SHIFT_{f.field.upper()} is {f.value!r}: {f.rule.removeprefix('Value error, ')}" for f in errors
        )
        raise InvalidSettings(said, errors) from e
