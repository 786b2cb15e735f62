"""Studies by name: read, check and list the files in ``data/studies`` and the built-in studies.

The name of a study is its file's name without the extension (``.yaml``, ``.yml`` or ``.json``, in upper or lower case).
A file replaces a built-in study of the same name.
"""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from functools import partial
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NamedTuple

from shift_schemas.errors import FieldError, InvalidStudy, shorten
from shift_schemas.ids import ID_RULE, is_id, propose_id
from shift_schemas.suggestions import did_you_mean
from shift_study.checks import study_warnings
from shift_study.loading import given_study, parse_study, study_data
from shift_study.study import Study

SUFFIXES = (".yaml", ".yml", ".json")
LARGEST_BYTES = 256 * 1024
"""The largest size of a study file; the same as of a study in the body of a request."""
BUILT_IN = "built-in"


class CheckedStudy(NamedTuple):
    """A study file as it was read. ``study`` is ``None`` if there are mistakes."""

    name: str
    """The name with which sessions are started: the file's name without the extension."""
    place: str
    """The file, or ``built-in``."""
    study: Study | None
    mistakes: tuple[str, ...]
    """One sentence each, with file and line."""
    warnings: tuple[str, ...]
    error: InvalidStudy | None

    @property
    def title(self) -> str:
        """The study's title; empty if it has no title or could not be read."""
        return self.study.title if self.study is not None else ""


def check_file(path: Traversable, place: str) -> CheckedStudy:
    """Read and check one study file. Return its mistakes instead of raising them."""
    name = _stem(path)
    try:
        _check_name(name, path.name)
        study = parse_study(_text(path), path.name, partial(_beside, path))
    except InvalidStudy as e:
        return CheckedStudy(name, place, None, e.sentences, (), e)
    warnings = (*_name_warnings(study, path), *_stimulus_warnings(study, path), *study_warnings(study))
    return CheckedStudy(name, place, study, (), warnings, None)


def list_studies(folder: Path) -> list[CheckedStudy]:
    """Return every study, checked, sorted by name. A file of the folder replaces a built-in study of the same name."""
    found: dict[str, CheckedStudy] = {}
    for name, paths in _by_name(folder).items():
        found[name] = _the_only(name, paths)
    return [found[name] for name in sorted(found)]


def find_study(name: str, folder: Path) -> CheckedStudy | None:
    """Return the study of that name, checked; ``None`` if no study has this name."""
    paths = _by_name(folder).get(name)
    return _the_only(name, paths) if paths else None


def study_text(name: str, folder: Path) -> str | None:
    """Return the text of the study's file, or of the built-in study; ``None`` if no study has this name.

    Raise :class:`InvalidStudy` if the file cannot be read as text.
    """
    paths = _by_name(folder).get(name)
    return _text(paths[0][0]) if paths else None


def study_names(folder: Path) -> tuple[str, ...]:
    """Return the names of all studies, sorted, without reading the files."""
    return tuple(sorted(_by_name(folder)))


def named_study(name: str, folder: Path) -> CheckedStudy:
    """Return the study of that name, checked and without mistakes.

    Raises
    ------
    InvalidStudy
        No study has this name (the sentence lists the known names), or its file has a mistake.
    """
    if not is_id(name):
        raise _refused(name, f"a study's name is an id: {ID_RULE}")
    found = find_study(name, folder)
    if found is None:
        raise _refused(name, unknown_study(name, folder))
    if found.error is not None:
        raise found.error
    return found


def unknown_study(name: str, folder: Path) -> str:
    """Return the sentence for a name that no study has, with the known names."""
    known = study_names(folder)
    return f"there is no study of that name; there are {', '.join(known)}{did_you_mean(name, known)}"


class StudyToStart(NamedTuple):
    """The study with which a session starts."""

    data: dict[str, Any]
    """A plain object with every default written out."""
    warnings: tuple[str, ...]


def study_to_start(given: str | dict[str, Any], folder: Path) -> StudyToStart:
    """Return the study that a start names, or contains, checked.

    Raise :class:`InvalidStudy` if no study has this name, or the study has a mistake.
    """
    if isinstance(given, str):
        found = named_study(given, folder)
        assert found.study is not None
        return StudyToStart(study_data(found.study), found.warnings)
    study = given_study(given)
    return StudyToStart(study_data(study), study_warnings(study))


# --- files ---


def _by_name(folder: Path) -> dict[str, list[tuple[Traversable, str]]]:
    """Return the files of each name: those of the folder, otherwise the built-in one."""
    found: dict[str, list[tuple[Traversable, str]]] = {}
    for path in _files(folder):
        found.setdefault(_stem(path), []).append((path, str(path)))
    for path in _files(files("shift_schemas") / "studies"):
        found.setdefault(_stem(path), [(path, BUILT_IN)])
    return found


def _files(folder: Traversable) -> Iterator[Traversable]:
    if folder.is_dir():
        for path in sorted(folder.iterdir(), key=lambda p: p.name):
            if path.name.lower().endswith(SUFFIXES) and not path.name.startswith(".") and path.is_file():
                yield path


def _stem(path: Traversable) -> str:
    return path.name.rsplit(".", 1)[0]


def _the_only(name: str, paths: list[tuple[Traversable, str]]) -> CheckedStudy:
    if len(paths) == 1:
        return check_file(*paths[0])
    names = " and ".join(path.name for path, _ in paths)
    error = _refused(name, f"{names} have the same name; keep one of them")
    return CheckedStudy(name, paths[0][1], None, error.sentences, (), error)


def _check_name(stem: str, file: str) -> None:
    if not is_id(stem):
        like = f"; rename it to {propose_id(stem)}.yaml"
        rule = f"sessions are started by the file's name, and {stem!r} is not an id: {ID_RULE}{like}"
        raise InvalidStudy(f"{file}: {rule}", (FieldError(field="study", value=shorten(stem), rule=rule),))


def _name_warnings(study: Study, path: Traversable) -> Iterator[str]:
    """Warn if the file has another name than its study. It is not a mistake: a copied or renamed file still starts."""
    stem = _stem(path)
    if study.study != stem:
        yield (
            f"{path.name}: sessions are started with {stem!r}, the file's name, and recorded under {study.study!r}, "
            f"its study; write study: {stem}, or rename the file to {study.study}.yaml"
        )


def _stimulus_warnings(study: Study, path: Traversable) -> Iterator[str]:
    """Warn if the stimulus image does not lie beside the study file."""
    if study.stimulus is not None and not (isinstance(path, Path) and (path.parent / study.stimulus).is_file()):
        yield f"stimulus: there is no image {study.stimulus} beside the study file; the page draws the AOIs alone"


def _refused(name: str, rule: str) -> InvalidStudy:
    error = FieldError(field="study", value=shorten(name), rule=rule)
    return InvalidStudy(f"study {error.value!r}: {rule}", (error,))


# --- text ---


def _beside(path: Traversable, name: str) -> str:
    """Return the text of a file in the folder of a study file. Raises OSError, ValueError."""
    if not isinstance(path, Path) or Path(name).name != name:
        raise ValueError("give the name of a file in the study's folder, without a path")
    return (path.parent / name).read_text(encoding="utf-8")


def _text(path: Traversable) -> str:
    try:
        raw = path.read_bytes()
    except OSError as e:
        raise InvalidStudy(f"{path.name} cannot be read: {e.strerror}") from e
    if len(raw) > LARGEST_BYTES:
        raise InvalidStudy(f"{path.name} has {len(raw) // 1024} KB; a study has at most {LARGEST_BYTES // 1024} KB")
    return decode_text(raw, path.name)


def decode_text(raw: bytes, name: str) -> str:
    """Return the text of a UTF-8 file, with or without a byte order mark.

    Raise :class:`InvalidStudy` for another encoding; the sentence names it, and says to save the file as UTF-8.
    """
    if encoding := _wide_encoding(raw):
        raise InvalidStudy(f"{name}: the file is {encoding}; save it as UTF-8")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as e:
        line = raw.count(b"\n", 0, e.start) + 1
        text = raw[raw.rfind(b"\n", 0, e.start) + 1 :].split(b"\n", 1)[0].decode("cp1252", "replace").strip()
        raise InvalidStudy(
            f"{name}:{line}: the file is not UTF-8 (byte {raw[e.start]:#04x}); in Latin-1 the line would be "
            f"{shorten(text)!r}; save the file as UTF-8"
        ) from e


def _wide_encoding(raw: bytes) -> str:
    if raw.startswith((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)):
        return "UTF-32"
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "UTF-16"
    return "UTF-16 or binary, since it contains zero bytes" if b"\0" in raw[:1000] else ""
