"""``shift-mesh doctor``: check whether every part of the mesh can be reached, and say why not."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from shift_cli.source_search import FoundSource


class Finding(NamedTuple):
    """The result of one check."""

    what: str
    fine: bool
    detail: str


def doctor(
    url: Annotated[str, typer.Option(help="The gateway.", envvar="SHIFT_URL")] = "http://127.0.0.1:8080",
    zenoh: Annotated[str, typer.Option(help="The router.", envvar="SHIFT_ZENOH")] = "tcp/127.0.0.1:7447",
    data: Annotated[
        Path | None, typer.Option(help="The data folder; left out: the one that the mesh uses.", envvar="SHIFT_DATA")
    ] = None,
    sources: Annotated[
        bool, typer.Option(help="Look for gaze sources as well: streams, devices, ROS topics.", envvar="SHIFT_SOURCES")
    ] = True,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.", envvar="SHIFT_JSON")] = False,
) -> None:
    """Check whether every part of the mesh can be reached, and say why not. The exit code is 1 if a check fails.

    It also looks for gaze sources, and says how to connect each. To find none is not a failure.

    \b
    shift-mesh doctor
    shift-mesh doctor --url http://127.0.0.1:9000 --json
    """
    ready, findings = _services(url)
    findings = [_router(zenoh), *findings, *_links(ready), _folder(data, ready)]
    if as_json:
        found = [source._asdict() for source in _sources(zenoh)] if sources else []
        document = {"fine": all(f.fine for f in findings), "findings": [f._asdict() for f in findings]}
        typer.echo(json.dumps({**document, "sources": found}))
    else:
        _print(findings)
        if sources:
            _print_sources(zenoh)
    raise typer.Exit(0 if all(f.fine for f in findings) else 1)


def _print(findings: list[Finding]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None)
    for column in ("", "what", "detail"):
        table.add_column(column)
    for found in findings:
        table.add_row("[green]ok[/]" if found.fine else "[red]no[/]", found.what, found.detail)
    Console().print(table)


def _sources(router: str) -> Iterator[FoundSource]:
    from shift_cli.source_search import found_sources

    return found_sources(router)


def _print_sources(router: str) -> None:
    found = list(_sources(router))
    for source in found:
        typer.echo(f"gaze source: {source.what}\n    connect it with: {source.connect}")
    if not found:
        typer.echo("gaze sources: none found; docs/trackers.md says how each eye tracker is connected")


def _router(zenoh: str) -> Finding:
    host, _, port = zenoh.partition("/")[2].rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=2.0).close()
    except (OSError, ValueError) as e:
        return Finding("router", False, f"{zenoh}: {e}; start the mesh with: shift-mesh up")
    return Finding("router", True, zenoh)


def _services(url: str) -> tuple[dict[str, Any], list[Finding]]:
    from shift_runtime.rest_client import RestClient
    from shift_schemas.errors import Unavailable

    try:
        with RestClient(url) as shift:
            ready = shift.ready()
    except Unavailable as e:
        return {}, [Finding("gateway", False, e.detail)]
    services = ready.get("services")
    if not isinstance(services, dict):
        return {}, [Finding("gateway", False, f"the server at {url} is not a gateway; give its address with --url")]
    return ready, [Finding(s, condition == "ready", str(condition)) for s, condition in services.items()]


def _links(ready: dict[str, Any]) -> list[Finding]:
    """Return a finding for each pair of services of which one does not reach the other."""
    return [Finding("link", False, str(sentence)) for sentence in ready.get("links", ())]


def _folder(given: Path | None, ready: dict[str, Any]) -> Finding:
    """Return whether the data folder can be used: that of the mesh, or the given one without a mesh."""
    known = sorted(set(ready.get("data", {}).values()))
    if given is not None and known and str(given.absolute()) not in known:
        return Finding("data folder", False, f"the mesh uses {' and '.join(known)}, not {given}; omit --data")
    data = given or Path(known[0] if known else "data")
    if known and not data.exists():
        return Finding("data folder", True, f"{data}, which is not on this machine (a container's, perhaps)")
    if not data.exists():
        return Finding("data folder", False, f"{data} does not exist; shift-mesh up makes it, or use --data")
    if not os.access(data, os.W_OK):
        return Finding("data folder", False, f"{data} is read-only")
    room = os.statvfs(data)
    return Finding("data folder", True, f"{data}, {room.f_bavail * room.f_frsize / 1e9:.1f} GB free")
