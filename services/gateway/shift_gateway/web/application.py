"""The NiceGUI application: its settings, and every page. Importing this module imports NiceGUI."""

from __future__ import annotations

import os
import re
from pathlib import Path

os.environ.setdefault("NICEGUI_STORAGE_PATH", os.devnull)  # the page keeps nothing on the server

from fastapi import FastAPI, HTTPException, Response
from fastapi.responses import FileResponse
from nicegui import app as nicegui_app
from nicegui import ui
from shift_study.fields import STIMULUS_PATTERN

from shift_gateway.docs_page import ICON
from shift_gateway.gateway import Gateway
from shift_gateway.web.desk_page import add_desk_page
from shift_gateway.web.evaluation_page import add_evaluation_page
from shift_gateway.web.live_histories import LiveHistories
from shift_gateway.web.recording_page import add_recording_page
from shift_gateway.web.recordings_page import add_recordings_page
from shift_gateway.web.room_elements import STIMULUS_PATH
from shift_gateway.web.room_page import add_room_page
from shift_gateway.web.start_page import add_start_page
from shift_gateway.web.study_page import add_study_page

ASSETS = Path(__file__).parent / "assets"
RECONNECT_S = 20.0
"""How long the state of a page is kept while its browser has no connection, seconds; chosen: longer than a restart."""


def make_pages(gateway: Gateway) -> FastAPI:
    """Return the application with every page of the gateway."""
    app = FastAPI(openapi_url=None)
    _add_stimuli(app, gateway.settings.data / "studies")
    nicegui_app.add_static_files("/page-assets", ASSETS, max_cache_age=0)
    histories = LiveHistories(gateway)
    add_start_page(gateway)
    add_room_page(gateway, histories)
    add_desk_page(gateway, histories)
    add_recordings_page(gateway)
    add_recording_page(gateway)
    add_study_page(gateway)
    add_evaluation_page()
    ui.run_with(
        app, title="SHIFT mesh", favicon=ICON, dark=None, language="en-US", tailwind=False, show_welcome_message=False,
        reconnect_timeout=RECONNECT_S, gzip_middleware_factory=None, binding_refresh_interval=None,
    )  # fmt: skip
    return app


def _add_stimuli(app: FastAPI, folder: Path) -> None:
    """Serve the images that studies name as their stimulus. A script in an SVG image does not run."""

    @app.get(f"{STIMULUS_PATH}/{{name}}")
    async def stimulus(name: str) -> Response:
        path = folder / name
        if not re.fullmatch(STIMULUS_PATTERN, name) or not path.is_file():
            raise HTTPException(404, "there is no such image beside the studies")
        return FileResponse(path, headers={"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'"})
