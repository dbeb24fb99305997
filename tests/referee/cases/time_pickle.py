"""Times and durations in pickles, which other programs read."""

import copy
import pickle
import pickletools

import genpy
import rospy
from referee import outcome, show

for value in (rospy.Time(1, 2), rospy.Duration(-1, 2), genpy.Time(1, 2), genpy.Duration(-1, 2)):
    pickled = pickle.dumps(value, 2)
    show(
        repr(value), [argument for _, argument, _ in pickletools.genops(pickled) if isinstance(argument, str)]
    )
    outcome("   loads", lambda pickled=pickled: pickle.loads(pickled))
    outcome("   deepcopy", lambda value=value: copy.deepcopy(value))
    show("   the same type", type(pickle.loads(pickled)) is type(value))

changed = rospy.rostime.get_rostime_cond()
show("get_rostime_cond", type(changed).__name__, changed is rospy.rostime.get_rostime_cond())
