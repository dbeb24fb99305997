"""What may have been meant by a name that does not exist: names that are similar."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from difflib import SequenceMatcher

__all__ = ["did_you_mean", "nearest"]


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """Up to three of the ``known`` names that may have been meant."""
    if not isinstance(name, str):
        # A program's argument, which is not found either.
        return []
    names = sorted(set(known))
    # A name without its package or namespace is what people forget most.
    tails = [each for each in names if each.rpartition("/")[2] == name]
    return (tails or _similar(name, names, 0.7))[:3]


_SLIP = 0.85
"""How similar two names are, by difflib's ratio, where one letter or two are missing, wrong or too many."""

_STEM = 4
"""The letters of a name that has been typed in part from which on those that continue it are suggested."""


def did_you_mean(word: str, known: Iterable[str], most: int = 2, *, only_slips: bool = False) -> str:
    """Return the suggestion after a word that does not exist: those of the ``known`` that are similar, "" if none is.

    ``only_slips``: those in which a letter or two are missing, wrong or too many.
    """
    suggestions = _similar(word, known, _SLIP if only_slips else 0.65)[:most]
    return f"; did you mean {' or '.join(suggestions)}?" if suggestions else ""


def _similar(word: str, known: Iterable[str], cutoff: float) -> list[str]:
    """Return the names that are as similar as ``cutoff``, by difflib's ratio; the most similar first.

    Names are compared part by part: a long namespace, the end of a file's name or the dashes of an option that two have
    in common say nothing.
    """
    from difflib import SequenceMatcher

    # The matcher keeps what it learns of its second sequence.
    wanted = [(part, SequenceMatcher(b=part)) for part in reversed(_parts_of(word))]
    found = []
    for name in known:
        parts = _parts_of(name)
        ratios = []
        for (meant, matcher), part in zip(wanted, reversed(parts), strict=False):
            matcher.set_seq1(part)
            ratios.append(1.0 if part == meant else _ratio(part, meant, matcher, cutoff))
        # The same name in another package or namespace may be meant, too.
        if ratios and (min(ratios) >= cutoff or (ratios[0] == 1 and cutoff < _SLIP)):
            found.append((-sum(ratios) / len(ratios), len(parts) != len(wanted), name))
    # Next to the name itself, in other letter cases or without its end, the others are not what is meant.
    exact = [entry for entry in found if entry[0] == -1]
    return [name for *_, name in sorted(exact or found)]


def _parts_of(name: str) -> list[str]:
    """Return the parts of a name that are compared, without the end of a file's name and the dashes of an option."""
    stem, dot, _ = name.rpartition(".")
    return [part for part in (stem if dot else name).lstrip("-").lower().split("/") if part]


def _ratio(part: str, meant: str, matcher: SequenceMatcher[str], cutoff: float) -> float:
    shorter, longer = sorted((part, meant), key=len)
    if cutoff < _SLIP and len(shorter) >= _STEM and longer.startswith(shorter):
        return max(cutoff, matcher.quick_ratio())
    # The first two are upper bounds, and are cheap.
    if matcher.real_quick_ratio() < cutoff or matcher.quick_ratio() < cutoff:
        return 0.0
    return matcher.ratio()
