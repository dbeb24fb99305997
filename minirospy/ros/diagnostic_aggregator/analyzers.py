"""Analyzers select statuses and report on them. Pure: times are arguments, in seconds.

A tree of analyzers is built from parameters. Source: http://wiki.ros.org/diagnostic_aggregator, and the output of ROS's
aggregator_node.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

__all__ = ["AnalyzerGroup", "Item", "Log", "OtherAnalyzer", "strip_prefix"]

OK, ERROR, STALE = 0, 2, 3
_MESSAGES = {0: "OK", 1: "Warning", 2: "Error", 3: "Stale"}
_PACKAGE = "diagnostic_aggregator"
_TIMEOUT = 5.0

Params = Mapping[str, Any]


class Log(Protocol):
    """Interface for logging the analyzers' warnings and errors about parameters and statuses."""

    def warn(self, text: str) -> None:
        """Report a problem that can be ignored."""

    def error(self, text: str) -> None:
        """Report an error."""


@dataclass
class Item:
    """A received status with its arrival time."""

    name: str
    time: float
    level: int = STALE
    message: str = "Missing"
    hardware_id: str = ""
    values: list[KeyValue] = field(default_factory=list)

    @classmethod
    def of(cls, status: DiagnosticStatus, now: float, log: Log) -> Item:
        """Create an item from a status. If its level is invalid, log an error and use ERROR instead."""
        level = status.level
        if level not in _MESSAGES:
            log.error(
                f"Attempting to convert {level} into DiagnosticLevel. Values are: {{0: OK, 1: Warning, 2: Error, 3: Stale}}"
            )
            level = ERROR
        return cls(status.name, now, level, status.message, status.hardware_id, list(status.values))

    def status(self, path: str, is_stale: bool) -> DiagnosticStatus:
        """Return the status for the tree, with ``path`` as its name."""
        return DiagnosticStatus(
            level=STALE if is_stale else self.level,
            name=f"{path.rstrip('/')}/{_shown(self.name)}",
            message=self.message,
            hardware_id=self.hardware_id,
            values=list(self.values),
        )


class Analyzer(Protocol):
    """A node in the tree of analyzers."""

    path: str
    name: str

    def match(self, name: str) -> bool:
        """Return whether the analyzer accepts statuses with this name."""

    def analyze(self, item: Item) -> bool:
        """Process a status; return whether the analyzer accepted it."""

    def report(self, now: float) -> list[DiagnosticStatus]:
        """Return the statuses for this part of the tree."""


class _Items:
    """An analyzer's items, with a header status."""

    def __init__(
        self, path: str, name: str, timeout: float, num_items: int = -1, discard_stale: bool = False
    ) -> None:
        self.path = path
        self.name = name
        self._timeout = timeout
        self._num_items = num_items
        self._discard_stale = discard_stale and timeout > 0
        self._items: dict[str, Item] = {}
        self._last_level = OK
        self._last_change = 0.0

    def analyze(self, item: Item) -> bool:
        self._items[item.name] = item
        return True

    def report(self, now: float) -> list[DiagnosticStatus]:
        """Return the header, followed by a status per item, sorted by name."""
        old = {name for name, item in self._items.items() if 0 < self._timeout < now - item.time}
        if self._discard_stale:
            self._items = {name: item for name, item in self._items.items() if name not in old}
        items = [self._items[name] for name in sorted(self._items)]

        header = DiagnosticStatus(name=self.path)
        header.values = [KeyValue(item.name, item.message) for item in items]
        levels = [STALE if item.name in old else item.level for item in items]
        header.level = STALE if all(level == STALE for level in levels) else min(max(levels), ERROR)
        header.message = _MESSAGES[header.level]
        self._check_number(header, len(items))
        was_stale = self._last_level == STALE and now - self._last_change > self._timeout
        if header.level != self._last_level:
            self._last_level, self._last_change = header.level, now
        # Omit the header once all items are discarded and its level has been STALE for longer than the timeout.
        if self._discard_stale and not items and was_stale:
            return []
        return [header, *(item.status(self.path, item.name in old) for item in items)]

    def _check_number(self, header: DiagnosticStatus, number: int) -> None:
        if self._num_items == number == 0:
            header.level, header.message = OK, "OK"
        elif self._num_items > 0 and number != self._num_items:
            header.level = max(header.level, ERROR)
            header.message = (
                f"Expected {self._num_items}, found {number}"
                if number
                else f"No items found, expected {self._num_items}"
            )


class GenericAnalyzer(_Items):
    """Accepts the statuses whose names match its parameters.

    Parameters: path, find_and_remove_prefix, startswith, name, contains, expected, regex, ...
    """

    def __init__(self, base_path: str, params: Params, namespace: str, now: float, log: Log) -> None:
        """Read the parameters. If they do not define an analyzer, report the error and raise ValueError."""
        path = params.get("path")
        if not isinstance(path, str):
            raise _fault(log, f'GenericAnalyzer was not given parameter "path". Namepspace: {namespace}')

        def words(key: str) -> list[str]:
            return _words(params.get(key, []), log)

        prefixes = words("find_and_remove_prefix")
        # As in ROS, the words of find_and_remove_prefix are added to both startswith and remove_prefix.
        self._starts = prefixes + words("startswith")
        self._removed = [_shown(word) for word in prefixes + words("remove_prefix")]
        self._names = words("name")
        self._parts = words("contains")
        self._expected = words("expected")
        self._patterns = list(_patterns(words("regex"), log))
        if not (self._starts or self._names or self._parts or self._expected or self._patterns):
            raise _fault(
                log,
                "GenericAnalyzer was not initialized with any way of checking diagnostics. Name: "
                f"{path}, namespace: {namespace}",
            )

        timeout = _number(params.get("timeout"), _TIMEOUT)
        discards = params.get("discard_stale") is True
        if discards and timeout <= 0:
            log.warn("Cannot discard stale items if no timeout specified. No items will be discarded")
        full = path if base_path == "/" else f"{base_path}/{path}"
        super().__init__(
            full if full.startswith("/") else f"/{full}",
            path,
            timeout,
            int(_number(params.get("num_items"), -1)),
            discards,
        )
        for name in self._expected:
            self.analyze(Item(name, now))

    def match(self, name: str) -> bool:
        return (
            name in self._expected
            or name in self._names
            or name.startswith(tuple(self._starts))
            or any(part in name for part in self._parts)
            or any(pattern.fullmatch(name) for pattern in self._patterns)
        )

    def report(self, now: float) -> list[DiagnosticStatus]:
        statuses = super().report(now)
        shown = {status.name.rpartition("/")[2] for status in statuses}
        missing = [name for name in self._expected if not shown & set(self._possible_names(name))]
        are_stale = all(status.level == STALE for status in statuses)
        statuses += [Item(name, now).status(self.path, True) for name in missing]

        for status in statuses:
            for prefix in self._removed:
                status.name = strip_prefix(status.name, prefix)
            if missing and status.name == self.path:
                status.level, status.message = (STALE, "All Stale") if are_stale else (ERROR, "Error")
                status.values += [KeyValue(name, "Missing") for name in missing]
        return statuses

    def _possible_names(self, name: str) -> list[str]:
        return [name, _shown(name), *(strip_prefix(name, prefix) for prefix in self._removed)]


class DiscardAnalyzer(GenericAnalyzer):
    """Accepts statuses like GenericAnalyzer, but reports nothing."""

    def report(self, now: float) -> list[DiagnosticStatus]:
        return []


class IgnoreAnalyzer:
    """Matches no statuses and reports nothing. To disable an analyzer in the parameters, set its type to this class."""

    path = name = ""

    def __init__(self, base_path: str, params: Params, namespace: str, now: float, log: Log) -> None:
        pass

    def match(self, name: str) -> bool:
        return False

    def analyze(self, item: Item) -> bool:
        return False

    def report(self, now: float) -> list[DiagnosticStatus]:
        return []


class OtherAnalyzer(_Items):
    """Reports the statuses that no other analyzer accepts, until they are stale."""

    def __init__(self, base_path: str, as_errors: bool) -> None:
        super().__init__(f"{base_path}/Other", "Other", _TIMEOUT, discard_stale=True)
        self._as_errors = as_errors

    def report(self, now: float) -> list[DiagnosticStatus]:
        statuses = super().report(now)
        if len(statuses) <= 1:
            return []
        if self._as_errors:
            statuses[0].level, statuses[0].message = ERROR, 'Unanalyzed items found in "Other"'
        return statuses


class AnalyzerGroup:
    """A group of analyzers with a header. Parameters: path, and analyzers, with one namespace per analyzer."""

    def __init__(self, base_path: str, params: Params, namespace: str, now: float, log: Log) -> None:
        """Create the analyzers and report errors; ``is_complete`` is False if one fails to initialize, or there are none."""
        path = params.get("path")
        self.name = path if isinstance(path, str) else ""
        full = f"{base_path}/{self.name}" if self.name and base_path not in ("", "/") else base_path
        if base_path in ("", "/"):
            full = self.name
        self.path = full if full.startswith("/") else f"/{full}"

        self._analyzers: list[Analyzer] = []
        self._failed: list[Item] = []
        self._namespace = f"{namespace.rstrip('/')}/analyzers"
        self._now, self._log = now, log
        analyzers = params.get("analyzers", {})
        if not isinstance(analyzers, Mapping):
            log.error(f"Parameter {self._namespace} is not a namespace of analyzers")
            analyzers = {}
        for name in sorted(analyzers):
            self._add_from(name, analyzers[name])
        if not self._analyzers:
            log.error(f"No analyzers initialized in AnalyzerGroup {self._namespace}")
        self.is_complete = bool(self._analyzers) and not self._failed

    def _add_from(self, name: str, params: object) -> None:
        if not isinstance(params, Mapping) or "type" not in params:
            self._log.error(
                f"Namespace {self._namespace} has no member 'type', unable to initialize analyzer for this namespace."
            )
            self._failed.append(Item(name, self._now, message="No Analyzer type given"))
            return
        kind = str(params["type"])
        if kind in _TYPES:
            full_name = f"{_PACKAGE}/{kind}"
            self._log.warn(
                "Analyzer specification should now include the package name. You are using a deprecated API. Please switch "
                f"from {kind} to {full_name} in your Analyzer specification."
            )
            kind = full_name
        make = _TYPES.get(kind.removeprefix(f"{_PACKAGE}/")) if kind.startswith(f"{_PACKAGE}/") else None
        if make is None:
            self._log.error(f"Unable to find Analyzer class {kind}. Check that Analyzer is fully declared.")
            return

        try:
            analyzer = make(self.path, params, f"{self._namespace}/{name}", self._now, self._log)
            if isinstance(analyzer, AnalyzerGroup) and not analyzer.is_complete:
                raise ValueError(name)
        except ValueError:
            self._log.error(f"Unable to initialize analyzer NS: {self._namespace}, type: {kind}")
            self._failed.append(Item(name, self._now, message="Analyzer init failed"))
            return
        self._analyzers.append(analyzer)

    def add(self, analyzer: Analyzer) -> None:
        """Add an analyzer to the group."""
        self._analyzers.append(analyzer)

    def remove(self, analyzer: Analyzer) -> bool:
        """Remove an analyzer; return whether the group contained it."""
        if analyzer not in self._analyzers:
            return False
        self._analyzers.remove(analyzer)
        return True

    def match(self, name: str) -> bool:
        return any(analyzer.match(name) for analyzer in self._analyzers)

    def analyze(self, item: Item) -> bool:
        matched = [analyzer.analyze(item) for analyzer in self._analyzers if analyzer.match(item.name)]
        return any(matched)

    def report(self, now: float) -> list[DiagnosticStatus]:
        if not self._analyzers:
            name = "/AnalyzerGroup" if self.path == "/" else self.path
            return [DiagnosticStatus(name=name, level=ERROR, message="No analyzers")]

        header = DiagnosticStatus(name=self.path)
        statuses: list[DiagnosticStatus] = []
        levels = []
        for analyzer in self._analyzers:
            reported = analyzer.report(now)
            statuses += reported
            for status in reported:
                if status.name == analyzer.path:
                    levels.append(status.level)
                    header.values.append(KeyValue(analyzer.name, status.message))
        highest = max(levels, default=OK)
        header.level = ERROR if highest == STALE and set(levels) != {STALE} else highest
        header.message = _MESSAGES[header.level]

        if self.path != "/":
            statuses.append(header)
        return statuses + [item.status(self.path, True) for item in self._failed]


_TYPES: dict[str, Callable[[str, Params, str, float, Log], Analyzer]] = {
    "AnalyzerGroup": AnalyzerGroup,
    "DiscardAnalyzer": DiscardAnalyzer,
    "GenericAnalyzer": GenericAnalyzer,
    "IgnoreAnalyzer": IgnoreAnalyzer,
}


def strip_prefix(name: str, prefix: str) -> str:
    """Remove ``prefix`` from the start of a name's last part, together with the following colon and spaces."""
    if not prefix:
        return name
    at = name.rfind("/") + 1
    # As in ROS, keep the prefix if it also occurs earlier in the name.
    if name.find(prefix) == at:
        name = name[:at] + name[at + len(prefix) :]
    if at and name[at:].startswith(":"):
        name = name[:at] + name[at + 1 :]
    return name[:at] + name[at:].lstrip(" ") if at else name


def _shown(name: str) -> str:
    return name.replace("/", " ")


def _fault(log: Log, text: str) -> ValueError:
    log.error(text)
    return ValueError(text)


def _number(value: object, default: float) -> float:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return float(value) if is_number else default  # type: ignore[arg-type]


def _words(value: object, log: Log) -> list[str]:
    """Return a string or list parameter as a list of strings; report an error and return [] for any other value."""
    if isinstance(value, str):
        return [value]
    if not isinstance(value, list):
        log.error(f"Parameter not a list or string, unable to return values. Value: {value!r}")
        return []
    if not all(isinstance(each, str) for each in value):
        log.error(f"Parameter is not a list of strings, found non-string value. Value: {value!r}")
        return []
    return value


def _patterns(texts: Iterable[str], log: Log) -> Iterable[re.Pattern[str]]:
    for text in texts:
        try:
            yield re.compile(text)
        except re.error as error:
            log.error(
                f"Attempted to make regex from {text}. Caught exception, ignoring value. Exception: {error}"
            )
