"""The error for a body that is not a JSON object, with a sentence for each kind of client. Pure.

The content type does not matter: ``curl -d`` declares JSON as a form, and the origin keeps foreign web pages out. Any
body in UTF-8 that is a JSON object is accepted. A compressed body is refused: a chunk of gaze is small, so compression
gains nothing on a lab's network, and unpacking would need a limit against decompression bombs.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from urllib.parse import parse_qsl, unquote_plus

from shift_schemas.errors import FieldError, MalformedMessage, ShiftError, shorten

BOM = b"\xef\xbb\xbf"
_FORM = re.compile(r"[\w.%+\[\]-]+=[^\s{}]*(&[\w.%+\[\]-]+=[^\s{}]*)*")
_LOOKED_AT = 4096
"""How many characters of a body that is not JSON are examined."""


class UnsupportedEncoding(ShiftError):
    """The body is compressed."""

    kind = "unsupported-encoding"
    status = 415
    title = "The body's content encoding is not supported"


def check_encoding(encoding: str) -> None:
    """Raise :class:`UnsupportedEncoding` if a ``Content-Encoding`` says that the body is compressed."""
    if encoding.strip().lower() not in ("", "identity"):
        said = f"the body is compressed (Content-Encoding: {shorten(encoding)})"
        raise UnsupportedEncoding(f"{said}; send it as it is, in chunks of at most 256 KB")


def without_mark(raw: bytes | str) -> bytes | str:
    """Return the body without the byte order mark that C# and PowerShell put before UTF-8."""
    return raw.removeprefix("\ufeff") if isinstance(raw, str) else raw.removeprefix(BOM)


def not_json(raw: bytes | str, query: Iterable[tuple[str, str]] = ()) -> MalformedMessage:
    """Return the error for a body that is not JSON. ``query`` is the part of the address after its question mark."""
    return _refused(f"the body must be JSON: {_why(raw, list(query))}")


def not_an_object(data: object) -> MalformedMessage:
    """Return the error for a body that is JSON, but not an object."""
    if isinstance(data, str):
        try:
            json.loads(data[:_LOOKED_AT])
        except (ValueError, RecursionError):
            return _refused("the body must be a JSON object, and it is a JSON string")
        return _refused("the body is a JSON string that contains JSON: it was encoded twice; send the object itself")
    if isinstance(data, list):
        return _refused("the body must be a JSON object, and it is a list; send one object in each request")
    return _refused(f"the body must be a JSON object, and it is {shorten(json.dumps(data))}")


def _refused(rule: str) -> MalformedMessage:
    return MalformedMessage(f"body: {rule}", (FieldError(field="body", value="", rule=rule),))


def _why(raw: bytes | str, query: list[tuple[str, str]]) -> str:
    if isinstance(raw, bytes):
        if said := _not_utf8(raw):
            return said
        raw = raw.decode()
    text = raw.strip()
    return _empty(text, query) or _form(text) or _other_quotes(text) or _syntax(text)


def _not_utf8(raw: bytes) -> str:
    if raw.startswith(b"\x1f\x8b"):
        return "it is compressed with gzip; send it as it is"
    head = raw[:_LOOKED_AT]
    if head.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in head[:4]:
        return "it is in UTF-16 or UTF-32; send it in UTF-8"
    try:
        raw.decode()
    except UnicodeDecodeError as e:
        at = f"byte {e.start} is 0x{raw[e.start]:02x}"
        return f"it is not in UTF-8 ({at}), but perhaps in Latin-1 or Windows-1252; send it in UTF-8"
    return ""


def _empty(text: str, query: list[tuple[str, str]]) -> str:
    if text:
        return ""
    if query:
        values = json.dumps(dict(query), ensure_ascii=False)
        return f"it is empty; write the values of the address into the body instead: {shorten(values)}"
    return 'it is empty; send an object, for example with curl -d \'{"name": "value"}\''


def _form(text: str) -> str:
    if text.startswith("--") and "form-data" in text[:_LOOKED_AT].lower():
        return "it is a form (multipart/form-data); send a JSON object, with curl by -d '{...}' instead of -F"
    if re.match(r"%(7B|5B|22|EF)", text, re.IGNORECASE):
        return "it is percent-encoded, as forms are; send the JSON as it is, and do not encode it as a URL"
    if len(text) <= _LOOKED_AT and _FORM.fullmatch(text):
        same = json.dumps(dict(parse_qsl(text, keep_blank_values=True)), ensure_ascii=False)
        return f"it is a form ({shorten(unquote_plus(text))}); send a JSON object: {shorten(same)}"
    return ""


def _other_quotes(text: str) -> str:
    if re.match(r"[\[{][\[{\s]*'", text):
        return "it has single quotes, as Python prints a dict; write it with json.dumps, with double quotes"
    if re.match(r"[\[{][\[{\s]*[“”„]", text):
        return 'it has typographic quotes; write straight ones (")'
    if re.match(r"\{\s*[A-Za-z_]\w*\s*:", text):
        return 'its names have no quotes (a shell may have taken them); write {"name": "value"}'
    return ""


def _syntax(text: str) -> str:
    try:
        json.loads(text)
    except json.JSONDecodeError as e:
        if e.msg == "Extra data":
            return "it has more after its first value; send one JSON object in each request"
        return f"{e.msg} in line {e.lineno}, column {e.colno}"
    except (ValueError, RecursionError):
        pass
    return "its nesting is too deep or a number is too long"
