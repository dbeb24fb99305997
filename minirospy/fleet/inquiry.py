"""Queries the fleet's robots, their status and their parameters, for commands that run without a master."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Awaitable, Callable
from typing import TypeVar

from minirospy.base.errors import BridgeError
from minirospy.fleet.clocks import ClockOffset, Ping, offset_of
from minirospy.fleet.keys import ROOT, Claim, parse_claim
from minirospy.fleet.network import FleetNetwork, NetworkOptions, QueryFailed
from minirospy.fleet.report import Answer, is_shallow, is_shown, parse_answer
from minirospy.runtime.transport.loop import new_event_loop

__all__ = ["fleet_status", "inquire", "robot_parameter"]

_T = TypeVar("_T")
_PINGS = 3
_MAX_CONCURRENT = 16


def inquire(options: NetworkOptions, question: Callable[[FleetNetwork], Awaitable[_T]]) -> _T:
    """Open a fleet session, call ``question`` with it, and return the result of that call.

    Raise BridgeError if neither a gateway nor a router is reached.
    """

    async def asking() -> _T:
        network = await FleetNetwork.open(options, waits=False)
        try:
            return await question(network)
        finally:
            await network.close()

    loop = new_event_loop()
    try:
        return loop.run_until_complete(asking())
    finally:
        loop.run_until_complete(loop.shutdown_default_executor())
        loop.close()


async def fleet_status(network: FleetNetwork, seconds: float) -> tuple[list[Answer], list[Answer]]:
    """Return the status of all robots and of all control rooms. Wait at most ``seconds`` for each gateway."""
    robots = await _claims(network, "robot", seconds)
    controls = await _claims(network, "control", seconds)
    limit = asyncio.Semaphore(_MAX_CONCURRENT)

    async def answer(claim: Claim) -> Answer:
        async with limit:
            try:
                data = await network.query(f"{ROOT}/status/{claim.gateway}", seconds=seconds)
            except QueryFailed:
                return Answer(claim, {})
            return Answer(claim, parse_answer(data), await _clock(network, claim, seconds))

    found = await asyncio.gather(*map(answer, [*robots, *controls]))
    return found[: len(robots)], found[len(robots) :]


async def robot_parameter(network: FleetNetwork, robot: str, name: str, seconds: float) -> object:
    """Return a robot's parameter, or a dict for a namespace. Raise BridgeError if the robot does not provide it."""
    claim = await _shown_claim(network, robot, seconds)
    if claim is None:
        raise BridgeError(
            f"no robot [{robot}] is in the fleet: `minirospy fleet status` lists those that are"
        )
    try:
        data = await network.query(
            f"{ROOT}/param/{claim.name}/{claim.gateway}", name.encode(), seconds=seconds
        )
        value: object = json.loads(data)
    except (QueryFailed, ValueError, RecursionError) as error:
        raise BridgeError(f"robot [{robot}]: {error}") from error
    if not is_shallow(value):
        raise BridgeError(f"robot [{robot}]: the value of [{name}] is nested too deeply")
    return value


async def _shown_claim(network: FleetNetwork, robot: str, seconds: float) -> Claim | None:
    """Return the claim of the gateway that represents a robot, or None if no gateway claims its name.

    If there are several claims, return the one that the control rooms show; raise BridgeError if the control rooms disagree.
    """
    claims = [each for each in await _claims(network, "robot", seconds) if each.name == robot]
    if len(claims) > 1:
        _, controls = await fleet_status(network, seconds)
        shown = [claim for claim in claims if is_shown(claim, controls)]
        # If all claims are from one machine, use the newest, because the token of a previous gateway may still exist.
        claims = (
            [max(shown, key=lambda claim: claim.start)] if len({each.host for each in shown}) == 1 else shown
        )
    if len(claims) > 1:
        machines = ", ".join(sorted({claim.host for claim in claims}))
        raise BridgeError(
            f"several machines call themselves [{robot}] ({machines}): give each its own name (--name)"
        )
    return claims[0] if claims else None


async def _claims(network: FleetNetwork, kind: str, seconds: float) -> list[Claim]:
    keys = await network.tokens(f"{ROOT}/{kind}/**", seconds)
    return sorted({claim for key in keys if (claim := parse_claim(key, kind)) is not None})


async def _clock(network: FleetNetwork, claim: Claim, seconds: float) -> ClockOffset | None:
    pings = []
    try:
        for _ in range(_PINGS):
            sent = time.time_ns()
            answer = await network.query(f"{ROOT}/ping/{claim.gateway}", seconds=seconds)
            if len(answer) == 8:
                pings.append(Ping(sent, int.from_bytes(answer, "little", signed=True), time.time_ns()))
    except QueryFailed:
        pass
    return offset_of(pings)
