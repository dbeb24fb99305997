"""PID controllers whose gains are parameters: ``from control_toolbox import Pid``.

In ROS, this class exists only in C++. Source: http://wiki.ros.org/control_toolbox.
"""

from __future__ import annotations

import math
from contextlib import ExitStack

from control_msgs.msg import PidState

from minirospy import client as rospy
from minirospy.core.control import pid
from minirospy.core.control.parameters import Parameters
from minirospy.core.control.pid import PidGains, PidTerms
from minirospy.ros.control_toolbox.control_toolbox.cfg import ParametersConfig
from minirospy.ros.dynamic_reconfigure.definition import close_server
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.encoding import Config
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.server import Server
from minirospy.ros.realtime_tools.realtime_tools import RealtimePublisher

__all__ = ["Pid", "PidGains"]


class Pid(pid.Pid):
    """A PID controller. :meth:`serve` lets dynamic_reconfigure change its gains and, if so configured, publishes its terms."""

    _server: Server | None = None
    _state: RealtimePublisher[PidState] | None = None

    @classmethod
    def read(cls, parameters: Parameters) -> Pid:
        """Return a controller with the gains from a namespace. It does not have topics yet.

        Raise ControllerError if ``p`` is missing, ValueError if a gain is not finite.
        """
        return cls(*PidGains.read(parameters))

    @classmethod
    def open(cls, parameters: Parameters, opened: ExitStack) -> Pid:
        """Read a controller's gains, call :meth:`serve` and return the controller. Closing ``opened`` closes the controller."""
        found = cls.read(parameters)
        opened.callback(found.close)
        found.serve(parameters)
        return found

    def serve(self, parameters: Parameters) -> None:
        """Start dynamic_reconfigure in the namespace; publish the topic ``state`` if the parameter ``publish_state`` is true."""
        if parameters.flag("publish_state", False):
            self._state = RealtimePublisher(f"{parameters.namespace}/state", PidState)
            self.on_computed = self._publish
        self._server = Server(ParametersConfig, self._reconfigure, parameters.namespace)

    def set_gains(self, gains: PidGains) -> None:
        """Change the gains, also in dynamic_reconfigure. Do not call this in ``update``: it calls the master."""
        self.gains = gains
        if self._server is not None:
            self._server.update_configuration(_config(gains))

    def close(self) -> None:
        """Close the topics and services."""
        if self._server is not None:
            close_server(self._server)
        if self._state is not None:
            self._state.close()

    def _reconfigure(self, config: Config, level: int) -> Config:
        is_first = level == ~0  # the first call has defaults for gains that are not set as parameters
        if is_first:
            config.update(_config(self.gains))
            return config

        gains = PidGains(
            config.p, config.i, config.d, config.i_clamp_max, config.i_clamp_min, config.antiwindup
        )
        if all(map(math.isfinite, gains)):
            self.gains = gains
        else:
            rospy.logwarn(
                "Gains must be finite numbers: the gains of %s stay.", self._server and self._server.ns
            )
            config.update(_config(self.gains))
        return config

    def _publish(self, terms: PidTerms) -> None:
        assert self._state is not None
        message = PidState(
            timestep=rospy.Duration.from_sec(terms.dt),
            error=self.error,
            error_dot=self.error_rate,
            p_error=self.error,
            i_error=self.error_integral,
            d_error=self.error_rate,
            p_term=terms.p,
            i_term=terms.i,
            d_term=terms.d,
            i_max=self.gains.i_max,
            i_min=self.gains.i_min,
            output=self.command,
        )
        message.header.stamp = rospy.Time.now()
        self._state.publish(message)


def _config(gains: PidGains) -> dict[str, float | bool]:
    """Return the gains under their dynamic_reconfigure names."""
    return {
        "p": gains.p,
        "i": gains.i,
        "d": gains.d,
        "i_clamp_min": gains.i_min,
        "i_clamp_max": gains.i_max,
        "antiwindup": gains.antiwindup,
    }
