"""The behaviour of every path: HEAD, OPTIONS, and answers for unknown paths and methods."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from fastapi import FastAPI, Request, Response
from fastapi.responses import JSONResponse
from fastapi.routing import APIRoute
from shift_schemas.errors import shorten
from starlette.exceptions import HTTPException
from starlette.routing import BaseRoute, Match, Route
from starlette.types import ASGIApp, Receive, Scope, Send

from shift_gateway.guard import Guard
from shift_gateway.origins import Rules
from shift_gateway.problems import MEDIA_TYPE

LIST = "the list of paths is at /docs, and as a document at /openapi.json"


class GatewayRoute(APIRoute):
    """A path that answers HEAD wherever it answers GET. FastAPI's own route answers 405."""

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Match HEAD as GET."""
        match, child = super().matches(scope)
        return (Match.FULL if match == Match.PARTIAL and self._reads_only(scope) else match), child

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer. The server leaves out the body of an answer to HEAD."""
        if self._reads_only(scope):
            await self.app(scope, receive, send)
        else:
            await super().handle(scope, receive, send)

    def _reads_only(self, scope: Scope) -> bool:
        return scope["method"] == "HEAD" and "GET" in (self.methods or ())


class GatewayApp(FastAPI):
    """The application with the guard around all of it, its errors included."""

    def __init__(self, rules: Rules, **given: object) -> None:
        super().__init__(docs_url=None, redoc_url=None, redirect_slashes=False, **given)  # type: ignore[arg-type]
        self._rules = rules
        self.router.route_class = GatewayRoute
        self.add_exception_handler(HTTPException, _on_http_error)

    def build_middleware_stack(self) -> ASGIApp:
        """Return FastAPI's stack within the guard."""
        return Guard(super().build_middleware_stack(), self._rules)


async def _on_http_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    path, headers, detail = request.url.path, dict(error.headers or {}), str(error.detail)
    if error.status_code == 405:
        headers["Allow"] = ", ".join(allowed := allowed_methods(request.app.routes, request.scope))
        if request.method == "OPTIONS":
            return Response(status_code=204, headers=headers)
        detail = f"{shorten(request.method)} is not possible here; {', '.join(allowed)} are"
    elif error.status_code == 404:
        detail = f"there is no such path; {proposal(request.app.routes, path) or LIST}"
    content = {"type": "about:blank", "title": str(error.detail), "status": error.status_code, "errors": []}
    content["detail"] = f"{shorten(request.method)} {path[:200]}: {detail}"
    return JSONResponse(content, error.status_code, headers=headers, media_type=MEDIA_TYPE)


def allowed_methods(routes: Iterable[BaseRoute], scope: Scope) -> list[str]:
    """Return the methods that the path of a request has."""
    matching = [r for r in _http(routes) if r.matches(scope)[0] != Match.NONE]
    found = {m for r in matching for m in r.methods or ()}
    return sorted(found | {"OPTIONS"} | ({"HEAD"} if "GET" in found else set()))


def proposal(routes: Iterable[BaseRoute], path: str) -> str:
    """Return what may have been meant: the path without a slash too many, or in lower case; else an empty text."""
    if "//" in path.rstrip("/"):
        return "it has two slashes in a row; is an id missing between them?"
    meant = path.rstrip("/")
    for route in _http(routes):
        found = re.match(route.path_regex.pattern, meant, re.IGNORECASE)
        if found is not None and (spelled := route.path_format.format(**found.groupdict())) != path:
            return f"write {shorten(spelled)}"
    return ""


def _http(routes: Iterable[BaseRoute]) -> Iterator[Route]:
    return (r for r in routes if isinstance(r, Route))
