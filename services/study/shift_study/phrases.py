"""What the robot says: the sentences of a study, and the text of one decision. Pure.

A sentence is chosen by levels of the decision's strategy. The templates of the remaining levels are put around it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Annotated, NamedTuple

from pydantic import AfterValidator, Field
from shift_schemas.ids import Id

from shift_study.fields import Level, StudyPart

TASK, SENTENCE = "task", "sentence"
"""The variables that need no entry: the task's id, and in a template the sentence."""
_VARIABLE = re.compile(r"\{([a-z][a-z0-9_]{0,31})\}")


def _checked(text: str) -> str:
    if not text.strip():
        raise ValueError("it is empty; write what the robot says, or remove the key")
    return _readable(text)


def _readable(text: str) -> str:
    """Return ``text``; raise ``ValueError`` for braces without a variable, and for characters that nobody can say."""
    if found := [c for c in text if ord(c) in (*range(32), 127) and not c.isspace()]:
        raise ValueError(f"it has the control character U+{ord(found[0]):04X}; remove it")
    if "{" in (rest := _VARIABLE.sub("", text)) or "}" in rest:
        raise ValueError("braces hold the name of a word, such as {object}: lower-case letters, digits and _")
    return text


def _template(text: str) -> str:
    if variables_of(text).count(SENTENCE) != 1:
        raise ValueError("a template has {sentence} once; write for example 'um, {sentence}'")
    return text


def _plain_word(text: str) -> str:
    if "{" in text or "}" in text:
        raise ValueError("a word cannot have braces; the sentences have them")
    return _readable(text)


def variables_of(text: str) -> list[str]:
    """Return the names in braces, in their order."""
    return _VARIABLE.findall(text)


LevelsKey = Annotated[str, Field(min_length=1, max_length=500)]
"""A level, or several joined with ``+``; ``STRATEGY.LEVEL`` where several strategies have a level of that name."""
Sentence = Annotated[str, Field(max_length=1000), AfterValidator(_checked)]
Template = Annotated[str, Field(max_length=1000), AfterValidator(_checked), AfterValidator(_template)]
Word = Annotated[str, Field(max_length=500), AfterValidator(_plain_word)]


class TaskPhrases(StudyPart):
    """The words and sentences of one task."""

    words: dict[Level, Word] = Field(default={}, description="The words for the variables of sentences and templates.")
    sentences: dict[LevelsKey, Sentence] = Field(
        default={}, description="Sentences of this task alone. If one of them fits, those for every task do not count."
    )


class PhrasesSettings(StudyPart):
    """What the robot says for each task and strategy. A decision then has a text."""

    sentences: dict[LevelsKey, Sentence] = Field(
        default={}, description="For every task: a level, or several joined with +, and its sentence."
    )
    templates: dict[Level, dict[Level, Template]] = Field(
        default={}, description="By strategy and level: what is put around a sentence that does not name the level."
    )
    tasks: dict[Id, TaskPhrases] = Field(default={}, description="The words and sentences of single tasks.")


class Phrase(NamedTuple):
    """What the robot says for one task and strategy, or what is missing for it."""

    text: str | None
    missing: tuple[str, ...]
    """The words that the task lacks. If it lacks none and there is no text, there is no sentence."""


def phrase_for(phrases: PhrasesSettings, task: str, strategy: Mapping[str, str]) -> Phrase:
    """Return what the robot says for a task; ``strategy`` has a level of each strategy.

    The first letter becomes a capital, and white space becomes single spaces.
    """
    own = phrases.tasks.get(task) or TaskPhrases()
    fitting = fitting_keys(own.sentences, strategy) or fitting_keys(phrases.sentences, strategy)
    if not fitting:
        return Phrase(None, ())
    key = fitting[0]
    words = {TASK: task, **own.words}
    text = own.sentences[key] if key in own.sentences else phrases.sentences[key]
    missing = [name for name in variables_of(text) if name not in words]
    text = _filled(text, words)
    for template in _templates_around(phrases, key, strategy):
        missing += [name for name in variables_of(template) if name not in words and name != SENTENCE]
        text = _filled(template, {**words, SENTENCE: text})
    text = " ".join(text.split())
    return Phrase(None, tuple(dict.fromkeys(missing))) if missing else Phrase(text[:1].upper() + text[1:], ())


def text_for(phrases: PhrasesSettings | None, task: str, strategy: Mapping[str, str]) -> str | None:
    """Return what the robot says, or None if the study has no sentence for it."""
    return phrase_for(phrases, task, strategy).text if phrases is not None else None


def fitting_keys(sentences: Mapping[str, str], strategy: Mapping[str, str]) -> list[str]:
    """Return the keys that name most levels of ``strategy`` and no other level. A correct study has one at most."""
    fitting = [key for key in sentences if all(_names_level(part, strategy) for part in parts_of(key))]
    most = max((len(parts_of(key)) for key in fitting), default=0)
    return [key for key in fitting if len(parts_of(key)) == most]


def parts_of(key: str) -> list[tuple[str, str]]:
    """Return strategy and level of each part of a key; the strategy is empty if the part does not name it."""
    parts = (part.strip().rpartition(".") for part in key.split("+"))
    return [(strategy, level) for strategy, _, level in parts]


def _names_level(part: tuple[str, str], strategy: Mapping[str, str]) -> bool:
    name, level = part
    return strategy.get(name) == level if name else level in strategy.values()


def _templates_around(phrases: PhrasesSettings, key: str, strategy: Mapping[str, str]) -> Iterator[str]:
    """Yield the templates of the levels that the key of the sentence does not name, in the order of the strategies."""
    named = parts_of(key)
    for name, level in strategy.items():
        template = phrases.templates.get(name, {}).get(level)
        if template is not None and (name, level) not in named and ("", level) not in named:
            yield template


def _filled(text: str, words: Mapping[str, str]) -> str:
    return _VARIABLE.sub(lambda found: words.get(found[1], ""), text)
