"""A rosbridge client's service calls in progress, and the services that it offers."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import BridgeError
from minirospy.web.json_text import dump_json, dump_json_in_pieces
from minirospy.web.rosbridge import conversion, protocol
from minirospy.web.rosbridge.operation import REFUSALS, Work, check_name
from minirospy.web.rosbridge.protocol import OperationError, StatusLevel
from minirospy.web.rosbridge.services import ClientService, Response, call

if TYPE_CHECKING:
    from minirospy.web.rosbridge.operation import OperationSession

__all__ = ["ClientServices"]

_log = logging.getLogger(__name__)

_MAX_CALLS = 200  # maximum number of concurrent calls per client
_MAX_SERVICES = 200  # maximum number of services that a client may offer


class ClientServices:
    """The calls and services of one client. Call the methods in the order of the client's operations."""

    def __init__(self, session: OperationSession) -> None:
        self.calls_size = 0
        """Bytes of memory used by the calls in progress."""
        self._session = session
        self._calls = 0  # number of calls in progress
        self._reporter = ErrorReporter(_log, "a client's call of a service")

    def close(self) -> None:
        """Stop offering the client's services. The session cancels the calls, which are its tasks."""
        shared = self._session.shared
        for name, service in list(shared.services.items()):
            if service.owner is self._session:
                shared.close_service(service, f"the client that offers {name} has disconnected")

    def call_service(self, event: protocol.CallService) -> None:
        if not self._session.is_allowed("services", event.service, "service, cancelling service call for"):
            return
        if self._calls >= _MAX_CALLS:
            raise BridgeError(f"{_MAX_CALLS} calls are under way: wait for an answer")
        size = self._session.operation_size
        self._calls += 1
        self.calls_size += size

        def ended(_: object) -> None:
            self._calls -= 1
            self.calls_size -= size
            self._session.count()

        self._session.spawn(self._call(event, is_large=self._session.is_large)).add_done_callback(ended)
        # Call count() last: if the client uses too much memory, count() disconnects it and cancels the call.
        self._session.count()

    async def _call(self, event: protocol.CallService, *, is_large: bool) -> None:
        try:
            self._session.require_write("calling services")
            check_name("service", event.service)
            in_thread = self._session.shared.in_thread if is_large else None
            response = await call(self._session.graph, event.service, event.arguments, in_thread)
            messages = await self._encoded(event, response)
        except REFUSALS as error:
            messages = self._failed(event, str(error))
            self._session.shared.log.warning(
                "[Client %s] call_service %s: %s", self._session.client.name, event.service, error
            )
        except Exception as error:  # noqa: BLE001 - the client waits for the answer, whatever happened here
            messages = self._failed(event, "the bridge failed on this call")
            self._reporter.report(error)
        self._session.send_encoded(messages)

    async def _encoded(self, event: protocol.CallService, response: Response) -> list[str | bytes]:
        """Encode a response as one or more messages; a large response is encoded in a thread."""
        shared = self._session.shared
        size = event.fragment_size or shared.options.fragment_size

        def encode(dump: Callable[[object], str]) -> list[str | bytes]:
            values = conversion.values(response.message())
            fields = protocol.service_response(event.service, values, event.id, result=True)
            return protocol.encode_messages(fields, event.compression, size, dump)

        if shared.is_quick(response.data):
            return encode(dump_json)
        return await shared.encode(lambda: encode(dump_json_in_pieces))

    def _failed(self, event: protocol.CallService, text: str) -> list[str | bytes]:
        size = event.fragment_size or self._session.shared.options.fragment_size
        fields = protocol.service_response(event.service, text, event.id, result=False)
        return protocol.encode_messages(fields, event.compression, size)

    def advertise_service(self, event: protocol.AdvertiseService) -> Work | None:
        if not self._session.is_allowed(
            "services", event.service, "service, cancelling service advertisement for"
        ):
            return None
        self._session.require_write("offering services")
        check_name("service", event.service)
        if (
            sum(each.owner is self._session for each in self._session.shared.services.values())
            >= _MAX_SERVICES
        ):
            raise BridgeError(f"a client may offer {_MAX_SERVICES} services")
        return self._offer(event)

    async def _offer(self, event: protocol.AdvertiseService) -> None:
        if event.service in self._session.shared.services:
            self._session.status(
                StatusLevel.WARNING, f"Duplicate service advertised. Overwriting {event.service}.", event.id
            )
        await self._session.shared.free_service(event.service, "Duplicate advertiser.")
        self._session.shared.services[event.service] = ClientService(
            self._session, self._session.send, self._session.graph, event.service, event.type
        )
        self._session.status(StatusLevel.INFO, f"Advertised service {event.service}.", event.id)

    def unadvertise_service(self, event: protocol.UnadvertiseService) -> Work:
        service = self._own_service(event.service)
        if service is None:
            raise OperationError(
                f"Service {event.service} has not been advertised via rosbridge, can't unadvertise.", event.id
            )
        why = f"Service {event.service} was unadvertised with a service call in progress"
        closing = self._session.shared.close_service(service, why)
        self._session.status(StatusLevel.INFO, f"Unadvertised service {event.service}.", event.id)
        return _ended(closing)

    def service_response(self, event: protocol.ServiceResponse) -> Work | None:
        service = self._own_service(event.service)
        if service is None:
            raise OperationError(f"Service {event.service} has not been advertised via rosbridge.", event.id)
        if self._session.is_large:
            return service.answered_large(event, self._session.shared.in_thread)
        service.answered(event)
        return None

    def _own_service(self, name: str) -> ClientService | None:
        service = self._session.shared.services.get(name)
        return service if service and service.owner is self._session else None


async def _ended(task: asyncio.Task[None]) -> None:
    await asyncio.wait([task])
