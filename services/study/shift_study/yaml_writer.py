"""Plain data as the text of a study file. Pure."""

from __future__ import annotations

from io import StringIO
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.representer import SafeRepresenter


class _Readable(SafeRepresenter):
    """Writes short rows and lists of plain values in one line, and everything else line by line."""

    def represent_mapping(self, tag: Any, mapping: Any, flow_style: Any = None) -> Any:
        """Choose the style by what is in the mapping."""
        items = dict(mapping)
        short = len(items) <= 3 and not any(isinstance(value, (dict, list)) for value in items.values())
        return super().represent_mapping(tag, items, flow_style=short)


def write_yaml(data: Any) -> str:
    """Return plain data as a study file; :func:`shift_study.yaml_reader.read_yaml` is the inverse."""
    yaml = YAML(typ="safe", pure=True)
    yaml.Representer = _Readable
    yaml.default_flow_style = None  # lists of plain values stand in one line
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # the order of strategies counts
    yaml.width = 110
    text = StringIO()
    yaml.dump(data, text)
    return text.getvalue()
