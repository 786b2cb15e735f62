"""The paths of the page as any HTTP client meets them: loaded late, guarded as all others, with their own policy."""

from __future__ import annotations

import httpx
import pytest
from support.whole_mesh import LiveMesh

PAGES = ("/", "/session/s1", "/session/s1/desk", "/recordings", "/study/coffee", "/evaluation")


@pytest.mark.parametrize("path", PAGES)
def test_page_is_html_with_the_security_headers(mesh: LiveMesh, path: str) -> None:
    answer = httpx.get(mesh.url + path, timeout=30)
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/html")
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert "connect-src 'self'" in answer.headers["content-security-policy"]
    assert answer.headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize("path", PAGES)
def test_head_of_a_page_has_no_body(mesh: LiveMesh, path: str) -> None:
    answer = httpx.head(mesh.url + path, timeout=30)
    assert (answer.status_code, answer.content) == (200, b"")


@pytest.mark.parametrize("path", ["/", "/_nicegui_ws/socket.io/?EIO=4&transport=polling"])
def test_page_of_another_origin_is_refused(mesh: LiveMesh, path: str) -> None:
    answer = httpx.get(mesh.url + path, headers={"Origin": "http://evil.example"}, timeout=30)
    assert answer.status_code == 403
    assert answer.headers["content-type"] == "application/problem+json"


def test_foreign_host_is_refused(mesh: LiveMesh) -> None:
    assert httpx.get(mesh.url, headers={"Host": "evil.example"}, timeout=30).status_code == 421


def test_unknown_path_stays_a_problem_document(mesh: LiveMesh) -> None:
    answer = httpx.get(mesh.url + "/nowhere", timeout=30)
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
