"""Settings of every process, read once at its start: flags, else environment (``SHIFT_...``), else default."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, ValidationError
from pydantic_settings import BaseSettings, SettingsConfigDict
from shift_schemas.errors import InvalidSettings, field_errors

DEFAULT_ROUTER = "tcp/127.0.0.1:7447"


class MeshSettings(BaseSettings):
    """What every process of the mesh needs to know."""

    model_config = SettingsConfigDict(env_prefix="SHIFT_", frozen=True, extra="ignore")

    zenoh: str = Field(default=DEFAULT_ROUTER, description="Endpoint of the router that the mesh meets at.")
    listen: str = Field(
        default="tcp/127.0.0.1:0",
        description="Where this process takes direct links of its peers; empty: everything goes by the router.",
    )
    data: Path = Field(default=Path("data"), description="Folder of recordings, studies and journals.")
    log_level: str = Field(default="info", description="debug, info, warning or error.")
    log_json: bool = Field(default=False, description="Logs as JSON lines.")


def read_settings(kind: type[MeshSettings] = MeshSettings, **given: object) -> MeshSettings:
    """The settings, with ``given`` (flags) above the environment. Raises :class:`InvalidSettings`."""
    try:
        return kind(**{k: v for k, v in given.items() if v is not None})  # type: ignore[arg-type]
    except ValidationError as e:
        errors = field_errors(e)
        said = "; ".join(f"SHIFT_{f.field.upper()} is {f.value!r}: {f.rule}" for f in errors)
        raise InvalidSettings(said, errors) from e
