"""rosmaster.registrations, which is not here: the import raises ImportError with what to use."""

from minirospy.compat.elsewhere import rosmaster_registrations as registrations
