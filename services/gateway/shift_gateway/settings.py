"""Settings of the gateway."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field
from pydantic_settings import NoDecode
from shift_runtime.settings import ClientSettings

from shift_gateway.origins import host_names, origin_names


class GatewaySettings(ClientSettings):
    """The addresses of the gateway, and who may use it."""

    host: str = Field(default="127.0.0.1", description="Address that the gateway listens on.")
    port: int = Field(default=8080, ge=0, le=65535, description="Port that the gateway listens on.")
    hosts: Annotated[tuple[str, ...], NoDecode, BeforeValidator(host_names)] = Field(
        default=(), description="Further names, comma separated, by which clients reach the gateway."
    )
    origins: Annotated[tuple[str, ...], NoDecode, BeforeValidator(origin_names)] = Field(
        default=(), description="Origins, comma separated, of other web pages that may use the gateway (CORS)."
    )
    patience_s: float = Field(default=4.0, gt=0, le=300, description="How long a service may take to come back, s.")
