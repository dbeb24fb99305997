"""The account of a server's memory: clients' shares, data queued for several clients, and the order in which it is released."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from minirospy.web.server.account import LARGE_PIECE, Account, Share
from minirospy.web.server.queue import SendQueue


class Holder:
    """A client that releases all its memory when requested."""

    def __init__(self, account: Account, address: str = "a", *, is_owner: bool = False) -> None:
        self.account = account
        self.sheds = 0
        self.share: Share = account.open(address, self.shed)
        self.share.is_owner = is_owner

    def shed(self) -> None:
        self.sheds += 1
        self.share.set(0)


def test_client_with_the_most_gives_up() -> None:
    account = Account(limit=100)
    first, second, third = (Holder(account) for _ in range(3))
    first.share.set(40)
    second.share.set(50)
    third.share.set(10)
    assert (account.total, account.shed) == (100, 0)
    third.share.set(11)
    assert (first.sheds, second.sheds, third.sheds) == (0, 1, 0)
    assert (account.total, account.shed) == (51, 1)
    third.share.set(5)
    account.close(first.share)
    account.close(first.share)
    assert account.total == 5


def test_address_with_the_most_gives_up_first() -> None:
    account = Account(limit=100)
    many = [Holder(account, "many") for _ in range(8)]
    single = Holder(account, "single")
    for each in many:
        each.share.set(8)
    single.share.set(36)
    many[0].share.set(9)
    assert (many[0].sheds, single.sheds) == (1, 0)


def test_owner_gives_up_last() -> None:
    account = Account(limit=100)
    owner, stranger = Holder(account, is_owner=True), Holder(account)
    owner.share.set(90)
    stranger.share.set(20)
    assert (owner.sheds, stranger.sheds, account.total) == (0, 1, 90)
    owner.share.set(120)
    assert (owner.sheds, account.total) == (1, 0)


def test_clients_give_up_until_the_limit_is_kept() -> None:
    account = Account(limit=100)
    small = [Holder(account) for _ in range(9)]
    for each in small:
        each.share.set(11)
    Holder(account).share.set(12)
    assert account.total == 99
    small[0].share.set(35)
    assert account.total == 88
    assert sum(each.sheds for each in small) == 1
    for each in small[1:]:
        each.share.set(12)
    assert account.total <= 100


def test_client_that_gives_up_nothing_is_not_chosen_for_ever() -> None:
    account = Account(limit=10)
    stubborn = account.open("a", lambda: None)
    other = Holder(account)
    other.share.set(5)
    stubborn.set(50)
    assert account.total == 5
    assert account.heaviest() is other.share


def test_large_piece_counts_once_however_many_wait_for_it() -> None:
    account = Account(limit=10 * LARGE_PIECE)
    queues = [SendQueue(share=account.open("a", lambda: None)) for _ in range(50)]
    image = bytes(LARGE_PIECE)
    for queue in queues:
        queue.put("image", (b"head", image))
        assert queue.large == LARGE_PIECE
    assert account.total == LARGE_PIECE
    queues[0].put("other", (bytes(LARGE_PIECE - 1),))
    assert account.total == LARGE_PIECE
    assert queues[0].pop() == (b"head", image)
    assert account.total == LARGE_PIECE
    for queue in queues[1:]:
        queue.clear()
    assert account.total == 0


def test_heaviest_client_is_known_by_shared_pieces_too() -> None:
    account = Account()
    one, two = account.open("a", lambda: None), account.open("a", lambda: None)
    image = bytes(LARGE_PIECE)
    one.hold((image, image))
    two.hold((image,))
    assert account.total == LARGE_PIECE
    assert account.heaviest() is one
    one.release((image, image))
    assert (one.weight, account.total) == (0, LARGE_PIECE)
    assert account.heaviest() is two
    two.release((image,))
    assert account.total == 0
    assert account.heaviest() is None


_STEPS = st.lists(
    st.tuples(
        st.integers(0, 3),
        st.sampled_from(["put", "put newest", "answer", "pop", "discard", "drop", "clear"]),
        st.integers(0, 3),
    ),
    max_size=60,
)


@given(_STEPS)
def test_account_is_the_sum_of_what_waits(steps: list[tuple[int, str, int]]) -> None:
    """However a message leaves a queue, its large pieces are removed from the account."""
    account = Account()
    shares = [account.open("a", lambda: None) for _ in range(4)]
    queues = [SendQueue(4 * LARGE_PIECE, share=share) for share in shares]
    pieces = [bytes(size) for size in (10, LARGE_PIECE - 1, LARGE_PIECE, 3 * LARGE_PIECE)]
    for number, step, which in steps:
        queue = queues[number]
        match step:
            case "put" | "put newest":
                queue.put(which, (b"head", pieces[which]), newest_only=step == "put newest")
            case "answer":
                queue.put_answer((pieces[which],))
            case "pop":
                queue.pop()
            case "discard":
                queue.discard(which)
            case "drop":
                queue.drop_messages()
                assert queue.size == 0
            case _:
                queue.clear()
        waiting = [
            piece
            for each in queues
            for entry in each._entries.values()
            if isinstance(entry.pieces, tuple)
            for piece in entry.pieces
            if len(piece) >= LARGE_PIECE
        ]
        assert account.total == sum({id(piece): len(piece) for piece in waiting}.values())
        assert sum(each.large for each in queues) == sum(map(len, waiting))
        assert [share.large for share in shares] == [each.large for each in queues]


def test_limits_are_those_that_are_documented() -> None:
    assert Account().limit == 160_000_000
    assert LARGE_PIECE == 32_768
    assert Share(Account(), "a", lambda: None).is_owner is False


def test_closed_client_is_not_chosen() -> None:
    account = Account(limit=100)
    gone, other = Holder(account), Holder(account)
    gone.share.set(50)
    account.close(gone.share)
    gone.share.large = 200
    other.share.set(101)
    assert (gone.sheds, other.sheds) == (0, 1)


def test_shedding_does_not_choose_again_within_itself() -> None:
    account = Account(limit=100)
    order: list[str] = []
    first, second = (account.open("a", lambda: None) for _ in range(2))

    def shed_first() -> None:
        order.append("first starts")
        # A message to the client, such as the reason, counts even while the account exceeds its limit.
        first.set(first.size + 1)
        order.append("first ends")
        first.set(0)

    def shed_second() -> None:
        order.append("second")
        second.set(0)

    first.shed, second.shed = shed_first, shed_second
    second.set(60)
    first.set(70)
    assert order == ["first starts", "first ends"]
    assert account.total == 60
    first.set(70)
    assert order == ["first starts", "first ends"] * 2
    assert not account.holders
    piece = bytes(LARGE_PIECE)
    account.hold((piece, piece))
    assert list(account.holders.values()) == [2]
    account.release((piece, piece))
    assert not account.holders
