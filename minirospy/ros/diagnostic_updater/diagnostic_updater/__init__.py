"""diagnostic_updater: tasks that fill diagnostic statuses, and the updater that publishes them on /diagnostics.

Source: http://wiki.ros.org/diagnostic_updater.
"""
