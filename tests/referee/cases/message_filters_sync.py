"""message_filters: which messages the synchronizers pass on together, and the results of the cache."""

import hashlib

import message_filters
import rospy
from referee import outcome, show
from std_msgs.msg import Header, String


class Stamped:
    """A message with a header, and a name to print."""

    def __init__(self, stamp, name):
        self.header = Header(stamp=stamp)
        self.name = name


class Numbers:
    """Random numbers that are the same in every Python."""

    def __init__(self, seed):
        self.state = seed * 2654435761 % 2**32

    def below(self, limit):
        self.state = (self.state * 1664525 + 1013904223) % 2**32
        return (self.state >> 8) % limit


def passed_on(make, inputs, seed, steps, spread, grid=1):
    """Return a synchronizer's output for random messages whose stamps are early or late by up to `spread` ms."""
    numbers = Numbers(seed)
    sources = [message_filters.SimpleFilter() for _ in range(inputs)]
    found = []
    synchronizer = make(sources)
    synchronizer.registerCallback(lambda *messages: found.append("+".join(each.name for each in messages)))
    for step in range(steps):
        source = numbers.below(inputs)
        late = numbers.below(2 * spread) - spread
        milliseconds = (100_000 + step * 3 + late) // grid * grid
        sources[source].signalMessage(Stamped(rospy.Time(0, milliseconds * 1_000_000), f"{source}.{step}"))
    waiting = [[str(stamp.to_nsec()) for stamp in queue] for queue in synchronizer.queues]
    return found, waiting


def approximate(queue, slop, **kwargs):
    return lambda sources: message_filters.ApproximateTimeSynchronizer(sources, queue, slop, **kwargs)


def exact(queue):
    return lambda sources: message_filters.TimeSynchronizer(sources, queue)


rospy.rostime.set_rostime_initialized(True)

show("exact:", *passed_on(exact(3), 2, 1, 40, 20, grid=10))
show("approximate:", *passed_on(approximate(5, 0.01), 2, 2, 40, 20))
show("approximate, three:", *passed_on(approximate(5, 0.03), 3, 3, 40, 20))

seed = 10
for inputs in (1, 2, 3, 4):
    for queue in (1, 2, 5, 9):
        for grid in (1, 5, 10):
            texts = []
            for slop in (0, 0.004, 0.01, 0.02, 0.05):
                for spread in (5, 20, 60):
                    seed += 1
                    found, waiting = passed_on(approximate(queue, slop), inputs, seed, 120, spread, grid)
                    texts.append(f"{len(found)} {found} {waiting}")
            seed += 1
            found, waiting = passed_on(exact(queue), inputs, seed, 120, 20, grid)
            texts.append(f"{len(found)} {found} {waiting}")
            sums = [text.partition(" ")[0] for text in texts]
            show(inputs, queue, grid, *sums, hashlib.md5("".join(texts).encode()).hexdigest())

# Of equally close stamps, the first to arrive is tried first; a slop is an exclusive limit.
for first, second in ((90, 110), (110, 90)):
    sources = [message_filters.SimpleFilter(), message_filters.SimpleFilter()]
    synchronizer = message_filters.ApproximateTimeSynchronizer(sources, 10, 0.02)
    synchronizer.registerCallback(lambda a, b: show("closest", a.name, b.name))
    sources[0].signalMessage(Stamped(rospy.Time(0, first * 1_000_000), first))
    sources[0].signalMessage(Stamped(rospy.Time(0, second * 1_000_000), second))
    sources[1].signalMessage(Stamped(rospy.Time(0, 100_000_000), "new"))
    sources[1].signalMessage(Stamped(rospy.Time(0, 130_000_000), "at the slop"))

# Calls of programs with their own inputs: no index, and queues that are dicts.
synchronizer = message_filters.ApproximateTimeSynchronizer([message_filters.SimpleFilter()] * 2, 3, 0.1)
synchronizer.registerCallback(lambda *messages: show("without an index", *[each.name for each in messages]))
synchronizer.queues = [{}, {}]
for index, milliseconds in (
    (0, 500),
    (0, 560),
    (1, 570),
    (1, 580),
    (0, 650),
    (0, 700),
    (0, 750),
    (1, 450),
    (1, 500),
):
    message = Stamped(rospy.Time(0, milliseconds * 1_000_000), f"{index}.{milliseconds}")
    synchronizer.add(message, synchronizer.queues[index])
    show([sorted(stamp.to_nsec() // 1_000_000 for stamp in queue) for queue in synchronizer.queues])

# Names of arguments, attributes, and callbacks' arguments.
source = message_filters.SimpleFilter()
show(
    source.registerCallback(lambda *given: show("given", *given), 1, 2),
    source.registerCallback(show, "second"),
)
source.signalMessage("a")
source.signalMessage("a", "b")
source.signalMessage()
synchronizer = message_filters.ApproximateTimeSynchronizer(
    fs=[source], queue_size=2, slop=0.5, allow_headerless=True
)
show(
    synchronizer.slop.to_sec(),
    synchronizer.queue_size,
    synchronizer.allow_headerless,
    synchronizer.enable_reset,
)
show(synchronizer.last_added.to_sec(), synchronizer.latest_stamps, synchronizer.input_connections)
synchronizer.registerCallback(lambda message: show("without a header", message.data))
source.signalMessage(String("x"))
strict = message_filters.ApproximateTimeSynchronizer([source], 2, 0.5)
strict.registerCallback(lambda message: show("never", message))
source.signalMessage(String("y"))

# The cache.
source = message_filters.SimpleFilter()
cache = message_filters.Cache(source, 4)
cache.registerCallback(lambda message: show("cached", message.name))
show(
    cache.getLatestTime(),
    cache.getLastestTime(),
    cache.getOldestTime(),
    cache.getLast(),
    cache.getInterval(rospy.Time(1), rospy.Time(2)),
)
for seconds in (10, 12, 11, 14, 13, 13):
    source.signalMessage(Stamped(rospy.Time(seconds), f"at {seconds}"))
source.signalMessage(String("dropped"))


def name(message):
    return message and message.name


for seconds in (9, 10, 11, 12, 13, 14, 15):
    show(
        seconds,
        name(cache.getElemAfterTime(rospy.Time(seconds))),
        name(cache.getElemBeforeTime(rospy.Time(seconds))),
    )
show([each.name for each in cache.getInterval(rospy.Time(11), rospy.Time(13))], name(cache.getLast()))
show(
    cache.getLatestTime().to_sec(),
    cache.getLastestTime().to_sec(),
    cache.getOldestTime().to_sec(),
    len(cache.cache_msgs),
)
outcome("turned round", lambda: cache.getInterval(rospy.Time(13), rospy.Time(11)))
headerless = message_filters.Cache(source, 2, allow_headerless=True)
source.signalMessage(String("kept"))
show(len(headerless.cache_msgs), headerless.cache_size, headerless.allow_headerless)

# Simulated time that jumps back.
for reset in (False, True):
    sources = [message_filters.SimpleFilter(), message_filters.SimpleFilter()]
    both = message_filters.TimeSynchronizer(sources, 10, reset=reset)
    near = message_filters.ApproximateTimeSynchronizer(sources, 10, 0.5, reset=reset)
    both.registerCallback(lambda a, b: show("exact", a.name, b.name))
    near.registerCallback(lambda a, b: show("near", a.name, b.name))
    for now, index, seconds in (
        (10, 0, 10),
        (10, 1, 10),
        (11, 0, 11),
        (12, 0, 12),
        (5, 0, 5),
        (5, 1, 12),
        (6, 1, 5),
        (6, 0, 6),
        (6, 1, 6),
        (7, 0, 7),
    ):
        rospy.rostime._set_rostime(rospy.Time(now))
        sources[index].signalMessage(Stamped(rospy.Time(seconds), f"{index}.{seconds}"))
        show(
            reset,
            now,
            [[stamp.secs for stamp in queue] for queue in both.queues + near.queues],
            [stamp.secs for stamp in both.latest_stamps],
        )
