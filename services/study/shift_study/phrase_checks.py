"""Checks of a study's phrases: keys that name no level, and strategies for which the robot has nothing to say. Pure.

A wrong key is a mistake. A missing sentence or word gives a warning: the robot is then silent, and the session goes on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from shift_schemas.suggestions import did_you_mean

from shift_study.phrases import SENTENCE, Phrase, PhrasesSettings, fitting_keys, parts_of, phrase_for
from shift_study.scoring_table import ScoringSettings

LISTED = 3
"""How many tasks or strategies a warning names."""
OTHER_TASK = "TASK"
"""Stands for a task that the phrases do not name; as an id it is unlikely, and no sentence depends on it."""


def phrase_mistakes(phrases: PhrasesSettings, tasks: Sequence[str] | None, scoring: ScoringSettings) -> Iterator[str]:
    """Yield a sentence for each mistake; each one begins with the path of the wrong part.

    ``tasks`` are the study's tasks; None: any id is a task.
    """
    yield from _wrong_sentences("phrases.sentences", phrases.sentences, scoring)
    for task, own in phrases.tasks.items():
        path = f"phrases.tasks.{task}"
        if tasks is not None and task not in tasks:
            yield f"{path} is not a task of the study; it has {', '.join(tasks)}{did_you_mean(task, tasks)}"
        if SENTENCE in own.words:
            yield f"{path}.words has {SENTENCE}, which is the variable of templates; give the word another name"
        yield from _wrong_sentences(f"{path}.sentences", own.sentences, scoring)
    yield from _wrong_templates(phrases, scoring)


def _wrong_sentences(path: str, sentences: Mapping[str, str], scoring: ScoringSettings) -> Iterator[str]:
    wrong = [f"{path} has the key {key!r}: {rule}" for key in sentences for rule in _wrong_parts(key, scoring)]
    yield from wrong
    if wrong:
        return
    for strategy in scoring.choices:
        keys = fitting_keys(sentences, strategy)
        if len(keys) > 1:
            levels = " + ".join(strategy.values())
            yield (
                f"{path} has {len(keys)} sentences for {levels}: {' and '.join(keys)}; remove one, or write one with "
                f"the key {'+'.join(_qualified(strategy, scoring))}"
            )
            return


def _wrong_parts(key: str, scoring: ScoringSettings) -> Iterator[str]:
    """Yield what is wrong with the parts of a key."""
    used: list[str] = []
    for name, level in parts_of(key):
        owners = [s for s, settings in scoring.strategies.items() if level in settings.levels]
        if name and name not in owners:
            yield f"strategy {name!r} with level {level!r} is not in the study; write one of {_known(scoring)}"
        elif not owners:
            levels = [v for settings in scoring.strategies.values() for v in settings.levels]
            yield f"{level!r} is not a level; write one of {_known(scoring)}{did_you_mean(level, levels)}"
        elif not name and len(owners) > 1:
            ways = " or ".join(f"{owner}.{level}" for owner in owners)
            yield f"several strategies have the level {level!r}; write {ways}"
        else:
            used.append(name or owners[0])
    if len(set(used)) != len(used):
        yield "it has two levels of one strategy, and a decision has one; write one sentence for each"


def _known(scoring: ScoringSettings) -> str:
    return ", ".join(dict.fromkeys(part for choice in scoring.choices for part in _qualified(choice, scoring)))


def _qualified(strategy: Mapping[str, str], scoring: ScoringSettings) -> list[str]:
    """Return the levels of a strategy as keys name them."""
    several = {name: sum(level in s.levels for s in scoring.strategies.values()) for name, level in strategy.items()}
    return [f"{name}.{level}" if several[name] > 1 else level for name, level in strategy.items()]


def _wrong_templates(phrases: PhrasesSettings, scoring: ScoringSettings) -> Iterator[str]:
    for name, templates in phrases.templates.items():
        if name not in scoring.strategies:
            meant = did_you_mean(name, scoring.strategies)
            yield f"phrases.templates.{name} is not a strategy; write one of {', '.join(scoring.strategies)}{meant}"
            continue
        levels = scoring.strategies[name].levels
        for level in templates:
            if level not in levels:
                meant = did_you_mean(level, levels)
                yield f"phrases.templates.{name}.{level} is not a level; write one of {', '.join(levels)}{meant}"


# --- warnings ---


def phrase_warnings(phrases: PhrasesSettings, tasks: Sequence[str] | None, scoring: ScoringSettings) -> tuple[str, ...]:
    """Return a sentence for each thing that the robot cannot say; tasks that lack the same thing share a sentence."""
    found: dict[str, list[str]] = {}
    for task in tasks if tasks is not None else [*phrases.tasks, OTHER_TASK]:
        for lack in _lacks({" + ".join(c.values()): phrase_for(phrases, task, c) for c in scoring.choices}):
            name = "any task that phrases.tasks does not name" if tasks is None and task == OTHER_TASK else task
            found.setdefault(lack, []).append(name)
    return tuple(f"phrases: {_some(names)}: {lack}; the robot then says nothing" for lack, names in found.items())


def _lacks(said: Mapping[str, Phrase]) -> Iterator[str]:
    """Yield what one task lacks; ``said`` has its phrase for each strategy."""
    if silent := [levels for levels, phrase in said.items() if phrase.text is None and not phrase.missing]:
        yield f"there is no sentence for {'any strategy' if len(silent) == len(said) else _some(silent)}"
    for word in dict.fromkeys(word for phrase in said.values() for word in phrase.missing):
        needed = [levels for levels, phrase in said.items() if word in phrase.missing]
        yield f"there is no word {{{word}}}, which the sentence for {_some(needed)} needs"


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:LISTED]) + (f" and {len(names) - LISTED} more" if len(names) > LISTED else "")
