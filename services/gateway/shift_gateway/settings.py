"""Settings of the gateway."""

from __future__ import annotations

from pydantic import Field
from shift_runtime.settings import MeshSettings


class GatewaySettings(MeshSettings):
    """Where the gateway is heard."""

    host: str = Field(default="127.0.0.1", description="Address that the gateway listens on.")
    port: int = Field(default=8080, ge=0, le=65535, description="Its port.")
    patience_s: float = Field(default=4.0, gt=0, le=300, description="How long a service may take to come back, s.")
