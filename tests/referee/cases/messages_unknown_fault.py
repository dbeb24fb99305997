"""The error's text if a message cannot be written, and genpy finds no field that is at fault."""

import io

import genpy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PointStamped
from referee import outcome
from sensor_msgs.msg import JointState, TimeReference
from std_msgs.msg import Duration, Header, Time

LATE, FRACTION = genpy.Time(1), genpy.Time(1)
LATE.secs, FRACTION.secs = 2**33, 1.5
LONG = genpy.Duration(1)
LONG.secs = 2**33

for time in (LATE, FRACTION):
    messages = [Header(stamp=time), Time(time), TimeReference(time_ref=time), GoalID(stamp=time, id="a")]
    messages += [
        PointStamped(header=Header(stamp=time)),
        JointState(header=Header(stamp=time), position=[1.0]),
    ]
    for message in messages:
        outcome(message._type, lambda: message.serialize(io.BytesIO()))
outcome("long", lambda: Duration(LONG).serialize(io.BytesIO()))

# Programs write floats into a time, as in `stamp.secs = time.time()`, and print the message.
for seconds, nanoseconds in ((1.5, 0), (1, 2.7), ("a", 1), (None, 0), (1, "x"), (True, False)):
    odd = genpy.Time(1)
    odd.secs, odd.nsecs = seconds, nanoseconds
    outcome("text", lambda: str(Header(stamp=odd)))
    outcome("text", lambda: genpy.message.strify_message(odd))
    outcome("text", lambda: genpy.message.strify_message(odd, fixed_numeric_width=6))
