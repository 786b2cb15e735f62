"""The documentation at ``/docs``: Swagger UI. The package fastapi-offline has its files, so it needs no other host."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from fastapi import FastAPI
from fastapi.responses import FileResponse, HTMLResponse, Response

CACHED = {"Cache-Control": "public, max-age=86400"}
FILES = {"swagger-ui-bundle.js": "text/javascript", "swagger-ui.css": "text/css"}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "font-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
HTML = """<!doctype html>
<html lang="en">
<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>SHIFT mesh: all paths</title>
<link rel="icon" href="/favicon.ico"><link rel="stylesheet" href="/docs/swagger-ui.css">
<div id="swagger-ui"></div>
<noscript>This page needs JavaScript. The same document without it: <a href="/openapi.json">/openapi.json</a></noscript>
<script src="/docs/swagger-ui-bundle.js"></script><script src="/docs/start.js"></script>
</html>
"""
START = """SwaggerUIBundle({url: '/openapi.json', dom_id: '#swagger-ui', deepLinking: true, validatorUrl: null,
  showExtensions: true, presets: [SwaggerUIBundle.presets.apis]});
"""
ICON = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">
<rect width="32" height="32" rx="7" fill="#0b57a4"/>
<path d="M8 21c4-12 12 2 16-10" fill="none" stroke="#fff" stroke-width="3.5" stroke-linecap="round"/></svg>"""


def static_folder() -> Path:
    """Return the folder with Swagger UI's files, without importing the package."""
    spec = importlib.util.find_spec("fastapi_offline")
    assert spec is not None
    assert spec.submodule_search_locations
    return Path(spec.submodule_search_locations[0]) / "static"


def add_docs(app: FastAPI) -> None:
    """Add ``/docs``, its files and the icon."""
    folder = static_folder()

    @app.get("/docs", include_in_schema=False)
    async def docs() -> Response:
        return HTMLResponse(HTML, headers={"Content-Security-Policy": POLICY})

    @app.get("/docs/start.js", include_in_schema=False)
    async def start() -> Response:
        return Response(START, media_type="text/javascript", headers=CACHED)

    for name, media_type in FILES.items():
        _add_file(app, folder / name, media_type)

    @app.get("/favicon.ico", include_in_schema=False)
    async def icon() -> Response:
        return Response(ICON, media_type="image/svg+xml", headers=CACHED)


def _add_file(app: FastAPI, path: Path, media_type: str) -> None:
    @app.get(f"/docs/{path.name}", include_in_schema=False)
    async def file() -> Response:
        return FileResponse(path, media_type=media_type, headers=CACHED)
