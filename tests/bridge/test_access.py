"""Who may connect: Host, Origin, tokens; and which names clients may use."""

from __future__ import annotations

import pytest

from minirospy.bridge.access import Access, Credentials, Grant, NameFilter, Refusal
from minirospy.errors import BridgeError

WRITE, READ = "write-token-0001", "read-token-00001"
GUARDED = Access(read_token=READ, write_token=WRITE, requires_token=True)


def request(
    host: str = "localhost:8765",
    origin: str | None = None,
    *,
    bearer: str = "",
    subprotocols: tuple[str, ...] = (),
    target: str = "/",
) -> Credentials:
    return Credentials(host, origin, f"Bearer {bearer}" if bearer else "", subprotocols, target)


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "http://localhost:3000",
        "http://127.0.0.1:8080",
        "http://[::1]:8080",
        "https://app.foxglove.dev",
        "file://",
    ],
)
def test_loopback_accepts_programs_front_ends_and_own_pages(origin: str | None) -> None:
    assert Access().check(request(origin=origin)) is Grant.WRITE


@pytest.mark.parametrize(
    "origin",
    [
        "https://evil.example",
        "null",
        "",
        "http://localhost.evil.example",
        "https://app.foxglove.dev.evil.example",
    ],
)
def test_pages_of_foreign_sites_are_refused(origin: str) -> None:
    refusal = Access().check(request(origin=origin))
    assert isinstance(refusal, Refusal)
    assert refusal.status == 403
    assert "--origin" in refusal.text


def test_configured_origins_are_accepted() -> None:
    access = Access(origins=("https://*.example.org",))
    assert access.check(request(origin="https://robots.example.org")) is Grant.WRITE
    assert isinstance(access.check(request(origin="https://example.com")), Refusal)


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8765", "", "localhost.evil.example", "[::1", "a b"]
)
def test_unknown_host_names_are_refused(host: str) -> None:
    refusal = Access().check(request(host))
    assert isinstance(refusal, Refusal)
    assert refusal.status == 403


@pytest.mark.parametrize(
    "host", ["localhost", "127.0.0.1:8765", "[::1]:8765", "192.168.1.5:8765", "Robot:1", "robot.local"]
)
def test_addresses_and_configured_names_are_known_hosts(host: str) -> None:
    assert Access(hosts=("robot", "robot.local")).check(request(host)) is Grant.WRITE


@pytest.mark.parametrize(
    "given",
    [
        request(bearer=WRITE),
        request(subprotocols=("foxglove.sdk.v1", f"minirospy.token.{WRITE}")),
        request(target=f"/?x=1&token={WRITE}"),
        request(bearer=WRITE, origin="https://any.example"),
    ],
)
def test_token_is_read_from_header_subprotocol_and_query(given: Credentials) -> None:
    assert GUARDED.check(given) is Grant.OWN


def test_tokens_have_their_rights() -> None:
    assert GUARDED.check(request(bearer=READ)) is Grant.READ
    for wrong in ("", "x", WRITE[:-1], WRITE + "x", "ä" * 20):
        refusal = GUARDED.check(request(bearer=wrong))
        assert isinstance(refusal, Refusal)
        assert refusal.status == 401
        assert WRITE not in refusal.text
        assert not wrong or wrong not in refusal.text.split()


def test_token_does_not_excuse_an_unknown_host() -> None:
    assert isinstance(GUARDED.check(request("evil.example", bearer=WRITE)), Refusal)


def test_read_only_loopback_grants_no_writing() -> None:
    assert Access(default_is_read=True).check(request()) is Grant.READ


@pytest.mark.parametrize(
    "options", [{"requires_token": True}, {"write_token": "short"}, {"read_token": "with blank s"}]
)
def test_unsafe_tokens_are_refused_at_the_start(options: dict[str, object]) -> None:
    with pytest.raises(BridgeError, match="token"):
        Access(**options)  # type: ignore[arg-type]


def test_name_filter_allows_and_denies_by_globs() -> None:
    names = NameFilter.of(["/camera/*", "/tf*"], ["*/compressed"])
    allowed = [name for name in ("/camera/a/raw", "/camera/compressed", "/tf_static", "/odom") if names(name)]
    assert allowed == ["/camera/a/raw", "/tf_static"]
    assert NameFilter.of()("/anything")


def test_whitelists_are_expressions_for_the_whole_name() -> None:
    names = NameFilter.of(whitelist=["/cam.*", "/ODOM"])
    assert [name for name in ("/camera", "/odom", "/odom2", "/x/cam") if names(name)] == ["/camera", "/odom"]
    assert not NameFilter.of(whitelist=[])("/camera")
    with pytest.raises(BridgeError, match="not a regular expression"):
        NameFilter.of(whitelist=["("])
