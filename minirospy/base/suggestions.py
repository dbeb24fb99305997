"""Suggest similar names for a name that does not exist."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from difflib import SequenceMatcher

__all__ = ["did_you_mean", "nearest"]


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """Return up to three names in ``known`` that are similar to ``name``."""
    if not isinstance(name, str):
        # Programs may pass a value that is not a string; no name is similar to that.
        return []
    names = sorted(set(known))
    # Prefer names that end with ``name``: the most common mistake is to omit the package or namespace.
    tails = [each for each in names if each.rpartition("/")[2] == name]
    return (tails or _similar(name, names, 0.7))[:3]


_SLIP = 0.85
"""Minimum similarity (difflib's ratio) of two names that differ only in one or two missing, wrong or extra letters."""

_STEM = 4  # minimum length, in letters, of a prefix for which completions are suggested


def did_you_mean(word: str, known: Iterable[str], most: int = 2, *, only_slips: bool = False) -> str:
    """Return "; did you mean ...?" with up to ``most`` of the ``known`` words that resemble ``word``, or "" if none does.

    ``only_slips``: suggest only words with one or two missing, wrong or extra letters.
    """
    suggestions = _similar(word, known, _SLIP if only_slips else 0.65)[:most]
    return f"; did you mean {' or '.join(suggestions)}?" if suggestions else ""


def _similar(word: str, known: Iterable[str], cutoff: float) -> list[str]:
    """Return the names whose similarity (difflib's ratio) is at least ``cutoff``, the most similar first.

    Names are compared part by part, so that a common long namespace, file extension or option dashes do not count as
    similarity.
    """
    from difflib import SequenceMatcher

    # Pass the part as the second sequence, for which the matcher caches its analysis.
    wanted = [(part, SequenceMatcher(b=part)) for part in reversed(_parts_of(word))]
    found = []
    for name in known:
        parts = _parts_of(name)
        ratios = []
        for (meant, matcher), part in zip(wanted, reversed(parts), strict=False):
            matcher.set_seq1(part)
            ratios.append(1.0 if part == meant else _ratio(part, meant, matcher, cutoff))
        # Also suggest names in other packages or namespaces that have the same last part.
        if ratios and (min(ratios) >= cutoff or (ratios[0] == 1 and cutoff < _SLIP)):
            found.append((-sum(ratios) / len(ratios), len(parts) != len(wanted), name))
    # If the name exists in another letter case or without an extension, suggest only that name.
    exact = [entry for entry in found if entry[0] == -1]
    return [name for *_, name in sorted(exact or found)]


def _parts_of(name: str) -> list[str]:
    """Return the parts of a name to compare, after removing the file extension or an option's leading dashes."""
    stem, dot, _ = name.rpartition(".")
    return [part for part in (stem if dot else name).lstrip("-").lower().split("/") if part]


def _ratio(part: str, meant: str, matcher: SequenceMatcher[str], cutoff: float) -> float:
    shorter, longer = sorted((part, meant), key=len)
    if cutoff < _SLIP and len(shorter) >= _STEM and longer.startswith(shorter):
        return max(cutoff, matcher.quick_ratio())
    # Avoid the slow ratio() if one of its cheap upper bounds is too low.
    if matcher.real_quick_ratio() < cutoff or matcher.quick_ratio() < cutoff:
        return 0.0
    return matcher.ratio()
