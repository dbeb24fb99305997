"""The tables and threads of rosmaster, which third-party masters use."""

import threading

from referee import show
from rosmaster.registrations import NodeRef, RegistrationManager, Registrations
from rosmaster.threadpool import MarkedThreadPool


class Pool:
    """Prints queued calls."""

    def queue_task(self, marker, task, args):
        show("task", marker, task.__name__, args)


def state(table):
    """Return the contents of a table."""
    return table.type, table.get_state(), sorted(table.map.items()), table.service_api_map, bool(table)


def refused(label, call):
    """Print the type and text of an error."""
    try:
        show(label, call())
    except Exception as error:  # noqa: BLE001 - any error is printed
        show(label, type(error).__name__, error)


show(
    [
        Registrations.TOPIC_SUBSCRIPTIONS,
        Registrations.TOPIC_PUBLICATIONS,
        Registrations.SERVICE,
        Registrations.PARAM_SUBSCRIPTIONS,
    ]
)
for kind in (0, 5, None):
    refused("kind", lambda: Registrations(kind))

topics = Registrations(Registrations.TOPIC_PUBLICATIONS)
for arguments in (
    ("/t", "/a", "http://a"),
    ("/t", "/a", "http://a"),
    ("/t", "/b", "http://b"),
    ("/u", "/a", "http://a"),
):
    topics.register(*arguments)
show(state(topics), "/t" in topics, topics.has_key("/x"), topics["/t"], topics["/x"], topics.get_apis("/t"))
show(topics.get_apis("/x"), sorted(topics.iterkeys()), topics.get_service_api("/t"))
for arguments in (
    ("/t", "/a", "http://x"),
    ("/t", "/a", "http://a"),
    ("/x", "/a", "http://a"),
    ("/u", "/a", "http://a", "rosrpc://a"),
):
    show("unregister", topics.unregister(*arguments))
topics.unregister_all("/b")
show(state(topics))

services = Registrations(Registrations.SERVICE)
refused("service without address", lambda: services.register("/s", "/a", "http://a"))
services.register("/s", "/a", "http://a", "rosrpc://a")
services.register("/s", "/b", "http://b", "rosrpc://b")
show(state(services), services.get_service_api("/s"), services.get_service_api("/x"))
show(services.unregister("/s", "/a", None, "rosrpc://a"), services.unregister("/s", "/b", None, "rosrpc://b"))
refused("service without address", lambda: services.unregister("/s", "/a", None))
services.register("/s", "/b", "http://b", "rosrpc://b")
services.unregister_all("/b")
show(state(services))

node = NodeRef("/n", "http://n")
show(node.id, node.api, node.is_empty())
for kind in (1, 2, 3, 4):
    node.add(kind, "/k")
    node.add(kind, "/k")
show(
    node.topic_subscriptions,
    node.topic_publications,
    node.services,
    node.param_subscriptions,
    node.is_empty(),
)
refused("add", lambda: node.add(5, "/k"))
refused("remove", lambda: node.remove(0, "/k"))
node.remove(1, "/k")
node.remove(1, "/k")
show(node.topic_subscriptions)
node.clear()
show(node.is_empty())

manager = RegistrationManager(Pool())
manager.register_publisher("/t", "/a", "http://a")
manager.register_subscriber("/t", "/a", "http://a")
manager.register_param_subscriber("/p", "/a", "http://a")
manager.register_service("/s", "/a", "http://a", "rosrpc://a")
tables = (manager.publishers, manager.subscribers, manager.services, manager.param_subscribers)
show(*map(state, tables), sorted(manager.nodes), manager.get_node("/a").api, manager.get_node("/x"))
manager.register_publisher("/u", "/a", "http://again")
show(*map(state, tables), manager.get_node("/a").api)
show(
    manager.unregister_publisher("/u", "/x", "http://x"), manager.unregister_publisher("/u", "/a", "http://x")
)
show(
    manager.unregister_service("/s", "/a", "rosrpc://a"),
    manager.unregister_subscriber("/t", "/a", "http://a"),
)
show(
    manager.unregister_param_subscriber("/p", "/a", "http://a"),
    manager.unregister_publisher("/u", "/a", "http://again"),
)
show(sorted(manager.nodes), manager.reverse_lookup("http://a"))

pool = MarkedThreadPool(3)
show(pool.get_thread_count(), pool.queue_task("a", 3), pool.queue_task("a", None))
done, held, order = threading.Event(), threading.Event(), []
show(pool.queue_task("slow", held.wait, ()), pool.queue_task("slow", order.append, ("after",)))
show(
    pool.queue_task("failing", int, ("x",)),
    pool.queue_task(None, order.append, (1,), lambda result: done.set()),
)
show(done.wait(60), order)
held.set()
done.clear()
show(
    pool.queue_task("slow", len, ("abc",), lambda result: (order.append(result), done.set())),
    done.wait(60),
    order,
)
show(
    pool.set_thread_count(1),
    pool.get_thread_count(),
    pool.join_all(),
    pool.get_thread_count(),
    pool.set_thread_count(2),
)
show(pool.get_thread_count(), pool.join_all(wait_for_tasks=False, wait_for_threads=False))
