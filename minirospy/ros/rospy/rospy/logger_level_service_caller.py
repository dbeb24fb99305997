"""rospy.logger_level_service_caller: reads and sets the levels of other nodes' loggers.

Source: the behaviour of rospy's class, which rqt_logger_level and programs that silence noisy nodes use.
"""

from __future__ import annotations

import rospy as rospy

from minirospy.ros.rosservice import rosservice as rosservice

__all__ = ["LoggerLevelServiceCaller", "ROSConsoleException"]

_GET, _SET = "/get_loggers", "/set_logger_level"


class ROSConsoleException(Exception):
    """Raised if a node does not list its loggers."""


class LoggerLevelServiceCaller:
    """Gets and sets the logger levels of other nodes."""

    def __init__(self) -> None:
        self._current_loggers: list[str] = []
        self._current_levels: dict[str, str] = {}

    def get_levels(self) -> list[str]:
        """Return the level names, least severe first."""
        return ["debug", "info", "warn", "error", "fatal"]

    def get_node_names(self) -> list[str]:
        """Return the nodes that provide the logger level services."""
        names = rosservice.get_service_list()
        return sorted(name.removesuffix(_SET) for name in names if name.endswith(_SET))

    def get_loggers(self, node: str) -> list[str]:
        """Return the names of a node's loggers; cache their levels.

        Raise ROSConsoleException if the node does not respond.
        """
        try:
            _, response = rosservice.call_service(_service(node, _GET), [])
        except rosservice.ROSServiceException as error:
            raise ROSConsoleException(
                f"node '{node}' doesn't exist or doesn't support query: {error}"
            ) from error
        self._current_levels = {logger.name: logger.level for logger in response.loggers}
        self._current_loggers = list(self._current_levels)
        return self._current_loggers

    def send_logger_change_message(self, node: str, logger: str, level: str) -> bool:
        """Set a level; return False if get_loggers() has already reported this level.

        Raise rosservice.ROSServiceException if the call fails.
        """
        if self._current_levels.get(logger) == level:
            return False
        rosservice.call_service(_service(node, _SET), [logger, level])
        if logger in self._current_levels:
            self.get_loggers(node)
        return True


def _service(node: str, name: str) -> str:
    return rospy.resolve_name(node) + name
