"""``GET /v1/studies``: the studies that sessions can be started with, checked without a session."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from fastapi import FastAPI
from shift_runtime.study_files import CheckedStudy, find_study, list_studies, unknown_study
from shift_schemas.errors import FieldError, UnknownThing, shorten
from shift_study.loading import study_data


def add_studies(app: FastAPI, folder: Path) -> None:
    """Add the paths. ``folder`` contains the study files; each request reads them, in a thread."""

    @app.get("/v1/studies", tags=["studies"])
    async def studies() -> dict[str, Any]:
        """Return every study by its name, with its mistakes and warnings, one sentence each."""
        return {"studies": [_summary(found) for found in await asyncio.to_thread(list_studies, folder)]}

    @app.get("/v1/studies/{name}", tags=["studies"])
    async def study(name: str) -> dict[str, Any]:
        """Return one study, every default written out; the answer to a study with mistakes names them."""
        found = await asyncio.to_thread(find_study, name, folder)
        if found is None:
            rule = await asyncio.to_thread(unknown_study, name, folder)
            error = FieldError(field="study", value=shorten(name), rule=rule)
            raise UnknownThing(f"study {error.value!r}: {rule}", (error,))
        if found.study is None:
            assert found.error is not None
            raise found.error
        return study_data(found.study)


def _summary(found: CheckedStudy) -> dict[str, Any]:
    return {"name": found.name, "title": found.title, "mistakes": found.mistakes, "warnings": found.warnings}
