"""rostopic's publishers and echo in programs that are not nodes yet."""

import rostopic
from referee import Other, show

other = Other(
    """
import rostopic
publisher, cls = rostopic.create_publisher("made", "std_msgs/Float32", True)
print(type(publisher).__name__, cls.__name__, publisher.name, publisher.resolved_name, flush=True)
rostopic.publish_message(publisher, cls, [1.5], rate=20)
"""
)
show(other.read())
show(rostopic.get_info_text("/made").split(" ")[:2])
echo = rostopic.CallbackEcho("/made", None, count=3)
rostopic._rostopic_echo("/made", echo)
show(echo.count, echo.done)
field = rostopic.CallbackEcho("/made/data", rostopic.msgevalgen("/data"), count=1)
rostopic._rostopic_echo("/made/data", field)
show(field.count, field.done)
show("ends", other.close(3.0) in (0, -15))
