"""Access control: Host, Origin and tokens, and the names that clients may use."""

from __future__ import annotations

import pytest

from minirospy.base.errors import BridgeError
from minirospy.base.name_filter import NameFilter
from minirospy.web.access import (
    Access,
    Credentials,
    Grant,
    Refusal,
    header_items,
    is_loopback,
    is_token,
    new_token,
)

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
        "https://studio.foxglove.dev",
        "https://lichtblick-suite.github.io",
        "file://",
        "lichtblick://a",
        "foxglove://a",
        "app://a",
        "vscode-webview://a",
        "HTTP://LOCALHOST:1",
        "http://page.localhost",
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
        "ftp://localhost",
        "http://",
        "lichtblickx://",
    ],
)
def test_pages_of_foreign_sites_are_refused(origin: str) -> None:
    refusal = Access().check(request(origin=origin))
    assert isinstance(refusal, Refusal)
    assert refusal.status == 403
    assert "--origin" in refusal.text


@pytest.mark.parametrize("scheme", ["http", "https"])
def test_page_of_the_server_itself_is_accepted(scheme: str) -> None:
    access = Access(hosts=("robot",))
    assert access.check(request("Robot:1", origin=f"{scheme}://robot:1")) is Grant.WRITE
    assert isinstance(access.check(request("robot:1", origin=f"{scheme}://robot:2")), Refusal)
    assert access.check(request("page.localhost:1", origin=f"{scheme}://page.localhost:1")) is Grant.WRITE


def test_refusals_name_the_reason_in_one_line() -> None:
    assert Access().check(request(origin="https://" + "x" * 200)) == Refusal(
        403, f"pages of 'https://{'x' * 92}' may not connect: start the bridge with --origin PATTERN", True
    )
    assert Access().check(request(origin="")) == Refusal(
        403, "pages of '' may not connect: start the bridge with --origin PATTERN", True
    )
    assert Access().check(request("y" * 200)) == Refusal(
        403,
        f"Host '{'y' * 100}' is not a name of this server: use its address, or start the bridge with --host-name NAME",
        True,
    )
    assert GUARDED.check(request()) == Refusal(
        401, "a token is required: the bridge prints it when it starts"
    )
    assert GUARDED.check(request(bearer="wrong-token-000")) == Refusal(
        401, "this token is wrong: the bridge prints the right one when it starts"
    )


@pytest.mark.parametrize("tokens", [{"read_token": READ}, {"write_token": WRITE}])
def test_token_that_is_not_required_may_be_absent_but_not_wrong(tokens: dict[str, str]) -> None:
    access = Access(**tokens)
    assert access.check(request()) is Grant.WRITE
    assert isinstance(access.check(request(bearer="wrong-token-000")), Refusal)
    required = Access(**tokens, requires_token=True)
    assert isinstance(required.check(request()), Refusal)
    assert Access().check(request(bearer="any-token-00000")) is Grant.WRITE


def test_query_has_fifty_fields_at_most() -> None:
    fields = "&".join(f"a{number}=1" for number in range(49))
    assert GUARDED.check(request(target=f"/?{fields}&token={WRITE}")) is Grant.OWN
    with pytest.raises(ValueError, match="Max number of fields"):
        GUARDED.check(request(target=f"/?{fields}&b=1&token={WRITE}"))


def test_loopback_is_known_by_name_and_address() -> None:
    for host in ("localhost", "page.localhost", "127.0.0.1", "127.9.9.9", "::1"):
        assert is_loopback(host) is True
    for host in ("", "robot", "localhost.evil.example", "192.168.1.5", "::2", "0.0.0.0"):
        assert is_loopback(host) is False


def test_tokens_are_random_and_have_their_form() -> None:
    made = {new_token() for _ in range(100)}
    assert len(made) == 100
    # 22 base64 characters encode 128 bits.
    assert {len(each) for each in made} == {22}
    for token in (*made, "a" * 8, "_-" * 100):
        assert is_token(token) is True
    for wrong in ("", "a" * 7, "a" * 201, "with blanks", "ümlauts-xx", None, 12345678, b"a" * 8):
        assert is_token(wrong) is False


def test_list_in_a_header_has_its_items() -> None:
    assert header_items({"x": "a, b ,,c"}, "x") == ["a", "b", "c"]
    assert header_items({}, "x") == []


def test_page_of_a_file_is_refused_with_the_option_that_admits_it() -> None:
    text = "a page that was opened from a file (Origin: null) may not connect: start the bridge with --origin null"
    assert Access().check(request(origin="null")) == Refusal(403, text, True)
    assert Access(origins=("null",)).check(request(origin="null")) is Grant.WRITE
    refusal = Access(file_option="websocket_null_origin:=true").check(request(origin="null"))
    assert isinstance(refusal, Refusal)
    assert refusal.text.endswith("start the bridge with websocket_null_origin:=true")


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
    assert NameFilter.of()("/anything") is True
    assert names("/odom") is names("/camera/compressed") is False


def test_whitelists_are_expressions_for_the_whole_name() -> None:
    names = NameFilter.of(whitelist=["/cam.*", "/ODOM"])
    assert [name for name in ("/camera", "/odom", "/odom2", "/x/cam") if names(name)] == ["/camera", "/odom"]
    assert not NameFilter.of(whitelist=[])("/camera")
    with pytest.raises(BridgeError, match="not a regular expression"):
        NameFilter.of(whitelist=["("])
