"""A state that calls a service."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from minirospy import client as rospy
from minirospy.core.idl.protocols import Message
from minirospy.ros.smach.smach.state import State
from minirospy.ros.smach.smach.user_data import Values
from minirospy.ros.smach_ros.smach_ros.callbacks import StateCallback

__all__ = ["ServiceState"]


class ServiceState(State):
    """A state that calls a service.

    Outcomes: "succeeded", "aborted", "preempted", and the callback's outcomes. The outcome is "aborted" if there is no
    request or no response, or if a callback raises an exception.
    """

    def __init__(
        self,
        service_name: str,
        service_spec: Any,
        request: object = None,
        request_cb: Callable[..., object] | None = None,
        request_cb_args: Sequence[object] = (),
        request_cb_kwargs: Mapping[str, object] | None = None,
        request_key: str | None = None,
        request_slots: Sequence[str] = (),
        response_cb: Callable[..., object] | None = None,
        response_cb_args: Sequence[object] = (),
        response_cb_kwargs: Mapping[str, object] | None = None,
        response_key: str | None = None,
        response_slots: Sequence[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        outcomes: Iterable[str] = (),
    ) -> None:
        """Create the state.

        The request is built from ``request``, from userdata (a whole request or single fields), and by ``request_cb``.
        ``request_cb(userdata, request)`` may change the request or return another one. ``response_cb(userdata,
        response)`` may return an outcome. ``response_key`` and ``response_slots`` select what is stored in the userdata.
        """
        super().__init__(outcomes=["succeeded", "aborted", "preempted"])
        self._service_name = service_name
        self._service_spec = service_spec
        self._proxy: rospy.ServiceProxy[Message] | None = None
        self._request = service_spec._request_class() if request is None else request
        self._request_key, self._request_slots = request_key, request_slots
        self._response_key, self._response_slots = response_key, response_slots
        self._request_cb = StateCallback(
            self, "Request", request_cb, input_keys, output_keys, request_cb_args, request_cb_kwargs
        )
        self._response_cb = StateCallback(
            self, "Response", response_cb, input_keys, output_keys, response_cb_args, response_cb_kwargs
        )

        self._request_cb.adopt()
        self._response_cb.adopt()
        self.register_input_keys([*input_keys, *request_slots, *([request_key] if request_key else [])])
        self.register_output_keys([*output_keys, *response_slots, *([response_key] if response_key else [])])
        self.register_outcomes(outcomes)

    def execute(self, ud: Values) -> str:
        """Call the service and return the outcome."""
        if self.preempt_requested():
            rospy.loginfo(f"Preempting {self._service_name} before sending request.")
            self.service_preempt()
            return "preempted"
        failure = self._connect() or self._make_request(ud)
        if failure:
            return failure

        assert self._proxy is not None
        try:
            rospy.logdebug(f"Calling service {self._service_name} with request:\n{self._request}")
            response = self._proxy(self._request)
        except rospy.ServiceException as error:
            rospy.logerr(f"Exception when calling service '{self._service_name}': {error}")
            return "aborted"
        return self._take_response(ud, response)

    def _connect(self) -> str | None:
        """Wait for the service. Return an outcome if it does not become available, otherwise None."""
        while self._proxy is None:
            if self.preempt_requested():
                rospy.loginfo(f"Preempting while waiting for service '{self._service_name}'.")
                self.service_preempt()
                return "preempted"
            if rospy.is_shutdown():
                rospy.loginfo(f"Shutting down while waiting for service '{self._service_name}'.")
                return "aborted"
            try:
                rospy.wait_for_service(self._service_name, 1.0)
                self._proxy = rospy.ServiceProxy(self._service_name, self._service_spec)
            except rospy.ROSInterruptException:
                rospy.logwarn(f"Terminated while waiting for service '{self._service_name}'.")
                return "aborted"
            except rospy.ROSException:
                rospy.logwarn(f"Still waiting for service '{self._service_name}'...")
        return None

    def _make_request(self, ud: Values) -> str | None:
        """Build the request. Return an outcome if that fails, otherwise None."""
        if self._request_key is not None:
            if self._request_key not in ud:
                rospy.logerr(
                    f"Requested request key '{self._request_key}' not in userdata struture. Available keys are: "
                    f"{list(ud.keys())}"
                )
                return "aborted"
            self._request = ud[self._request_key]
        for key in self._request_slots:
            if key not in ud:
                rospy.logerr(
                    f"Requested request slot key '{key}' is not in userdata strcture. Available keys are: "
                    f"{list(ud.keys())}"
                )
                return "aborted"
            setattr(self._request, key, ud[key])

        is_fine, changed = self._request_cb(ud, self._request)
        if not is_fine:
            return "aborted"
        if changed is not None:
            self._request = changed
        return None

    def _take_response(self, ud: Values, response: Message) -> str:
        is_fine, outcome = self._response_cb(ud, response)
        if not is_fine:
            return "aborted"
        if outcome is not None and outcome not in self.get_registered_outcomes():
            rospy.logerr(
                f"Result callback for service {self._service_name}, {self._response_cb} was not registered with the "
                f"response_cb_outcomes argument. The response callback returned '{outcome}' but the only registered outcomes "
                f"are: {self.get_registered_outcomes()}"
            )
            return "aborted"
        if self._response_key is not None:
            ud[self._response_key] = response
        for key in self._response_slots:
            ud[key] = getattr(response, key)
        return "succeeded" if outcome is None else str(outcome)
