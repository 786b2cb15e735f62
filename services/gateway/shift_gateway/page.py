"""The page at ``/``: the services, the sessions, and how to start. It asks ``/readyz`` and ``/v1/sessions``."""

from __future__ import annotations

import base64
import hashlib

PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>SHIFT mesh</title><link rel="icon" href="/favicon.ico">
<style>
 body{font:16px/1.5 system-ui,sans-serif;max-width:46rem;margin:2rem auto;padding:0 1rem;
  color:#1b2733;background:#fff}
 h1{font-size:1.5rem;margin-bottom:.2rem} h2{font-size:1.1rem;margin-top:2rem}
 table{border-collapse:collapse;width:100%} th,td{text-align:left;padding:.3rem .6rem;border-bottom:1px solid #d8dee6}
 pre{background:#f2f5f8;padding:.8rem;overflow-x:auto;border-radius:6px;font-size:.85rem}
 .ok{color:#0a6b3d}.no{color:#a3260d} a{color:#0b57a4}
</style>
<h1>SHIFT mesh</h1>
<p>How should the robot phrase its next explanation for this person, now?</p>
<h2>What runs</h2>
<table aria-live="polite"><thead><tr><th>service</th><th>condition</th></tr></thead>
<tbody id="services"></tbody></table>
<h2>Sessions</h2>
<table><thead>
<tr><th>session</th><th>participant</th><th>study</th><th>state</th><th>decisions</th></tr></thead>
<tbody id="sessions"></tbody></table>
<h2>How to start</h2>
<pre>curl -X POST ORIGIN/v1/sessions \\
     -d '{"participant": "P01", "session": "s1"}'
curl -X POST ORIGIN/v1/sessions/s1/decisions \\
     -d '{"task": "grasp"}'</pre>
<p><a href="/docs">All paths</a> · <a href="/openapi.json">OpenAPI</a> · <a href="/readyz">readiness</a> ·
<a href="/metrics">metrics</a> · <a href="/v1/recordings">recordings</a></p>
<script>
const cell = (row, text, kind) => {
  const td = row.insertCell(); td.textContent = text ?? ''; if (kind) td.className = kind; };
const fill = (id, rows) => { const body = document.getElementById(id); body.replaceChildren();
  for (const cells of rows) {
    const row = body.insertRow(); for (const [text, kind] of cells) cell(row, text, kind); } };
async function refresh() {
  try {
    const ready = await (await fetch('/readyz')).json();
    fill('services', Object.entries(ready.services).map(([s, c]) => [[s], [c, c === 'ready' ? 'ok' : 'no']]));
    const known = await (await fetch('/v1/sessions')).json();
    fill('sessions', (known.sessions ?? []).map(s => [[s.session], [s.participant], [s.study], [s.state],
      [(s.counts ?? {}).decision ?? 0]]));
  } catch (e) { fill('services', [[['gateway'], ['does not answer', 'no']]]); }
  setTimeout(refresh, 2000);
}
for (const pre of document.querySelectorAll('pre'))
  pre.textContent = pre.textContent.replaceAll('ORIGIN', location.origin);
refresh();
</script>
</html>
"""


def _policy(page: str) -> str:
    """Return the content security policy of a page: its one script by its hash, and nothing from another host."""
    script = page.split("<script>")[1].split("</script>")[0]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src 'self'; "
        "connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
    )


PAGE_POLICY = _policy(PAGE)
