"""tf.Transformer, TransformerROS and TransformListener: return transforms as tuples, and transform messages.

Methods that need matrices import numpy on first use. Source: http://wiki.ros.org/tf.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import geometry_msgs.msg
import sensor_msgs.msg
from std_msgs.msg import Header

from minirospy import client as rospy
from minirospy.base import times
from minirospy.base.errors import TransformException
from minirospy.ros.tf.tf import transformations
from minirospy.ros.tf2_ros.tf2_ros.buffer import Buffer
from minirospy.ros.tf2_ros.tf2_ros.listener import TransformListener as Tf2Listener
from minirospy.ros.tf2_ros.tf2_ros.messages import Moment

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

__all__ = [
    "TransformListener",
    "Transformer",
    "TransformerROS",
    "strip_leading_slash",
    "xyz_to_mat44",
    "xyzw_to_mat44",
]

Tuples = tuple[list[float], list[float]]
Vector = tuple[float, float, float]
_Point: TypeAlias = "geometry_msgs.msg.Point | geometry_msgs.msg.Point32 | geometry_msgs.msg.Vector3"
_WITHOUT_THREAD = "cannot wait for transform without a dedicated thread that listens to incoming TF messages"


def xyz_to_mat44(pos: _Point) -> NDArray[numpy.float64]:
    """Return the 4x4 translation matrix for a Point or Vector3."""
    return transformations.translation_matrix((pos.x, pos.y, pos.z))


def xyzw_to_mat44(ori: geometry_msgs.msg.Quaternion) -> NDArray[numpy.float64]:
    """Return the 4x4 rotation matrix for a Quaternion message."""
    return transformations.quaternion_matrix((ori.x, ori.y, ori.z, ori.w))


def strip_leading_slash(s: str) -> str:
    """Remove a leading slash from a frame name; tf2 rejects such names."""
    return s[1:] if s.startswith("/") else s


class Transformer:
    """Stores transforms and looks them up. ``interpolate`` has no effect."""

    def __init__(self, interpolate: bool = True, cache_time: Moment | None = None) -> None:
        self._buffer = Buffer(cache_time, debug=False)
        self._using_dedicated_thread = False

    def allFramesAsDot(self, current_time: Moment | None = None) -> str:
        """Return the frame tree as a graphviz graph."""
        return self._buffer._allFramesAsDot(current_time) if current_time else self._buffer._allFramesAsDot()

    def allFramesAsString(self) -> str:
        """Return one line of text for each frame that has a parent."""
        return self._buffer.all_frames_as_string()

    def setTransform(
        self, transform: geometry_msgs.msg.TransformStamped, authority: str = "default_authority"
    ) -> None:
        """Insert a transform into the buffer."""
        self._buffer.set_transform(transform, authority)

    def canTransform(self, target_frame: str, source_frame: str, time: Moment) -> int | tuple[int, str]:
        """Return 1 if the transform is available, otherwise 0."""
        return self._buffer.can_transform(
            strip_leading_slash(target_frame), strip_leading_slash(source_frame), time
        )

    def canTransformFull(
        self, target_frame: str, target_time: Moment, source_frame: str, source_time: Moment, fixed_frame: str
    ) -> int | tuple[int, str]:
        """Return 1 if the transform between two times is available, otherwise 0."""
        target, source, fixed = map(strip_leading_slash, (target_frame, source_frame, fixed_frame))
        return self._buffer.can_transform_full(target, target_time, source, source_time, fixed)

    def waitForTransform(
        self,
        target_frame: str,
        source_frame: str,
        time: Moment,
        timeout: Moment,
        polling_sleep_duration: Moment | None = None,
    ) -> None:
        """Wait for a transform for at most ``timeout``. ``polling_sleep_duration`` has no effect.

        Raise tf.Exception if the transform is not available by then.
        """
        self._check_thread()
        target, source = strip_leading_slash(target_frame), strip_leading_slash(source_frame)
        self._raise_unless(
            self._buffer.can_transform(target, source, time, timeout, return_debug_tuple=True),
            source_frame,
            target_frame,
        )

    def waitForTransformFull(
        self,
        target_frame: str,
        target_time: Moment,
        source_frame: str,
        source_time: Moment,
        fixed_frame: str,
        timeout: Moment,
        polling_sleep_duration: Moment | None = None,
    ) -> None:
        """Like :meth:`waitForTransform`, for a transform between two times."""
        self._check_thread()
        target, source, fixed = map(strip_leading_slash, (target_frame, source_frame, fixed_frame))
        self._raise_unless(
            self._buffer.can_transform_full(target, target_time, source, source_time, fixed, timeout, True),
            source_frame,
            target_frame,
        )

    def chain(
        self, target_frame: str, target_time: Moment, source_frame: str, source_time: Moment, fixed_frame: str
    ) -> list[str]:
        """Return the frames on the path from the source frame to the target frame via the fixed frame."""
        return self._buffer._chain(target_frame, target_time, source_frame, source_time, fixed_frame)

    def clear(self) -> None:
        """Remove all transforms except static ones from the buffer."""
        self._buffer.clear()

    def frameExists(self, frame_id: str) -> bool:
        """Return whether the frame has a parent."""
        return frame_id in self.getFrameStrings()

    def getFrameStrings(self) -> list[str]:
        """Return the frames that have a parent."""
        import yaml

        return list(yaml.safe_load(self._buffer.all_frames_as_yaml()) or {})

    def getLatestCommonTime(self, source_frame: str, dest_frame: str) -> rospy.Time:
        """Return the latest time at which the transform can be looked up. Raise tf.Exception if there is no such time."""
        return self._buffer.get_latest_common_time(
            strip_leading_slash(source_frame), strip_leading_slash(dest_frame)
        )

    def lookupTransform(self, target_frame: str, source_frame: str, time: Moment) -> Tuples:
        """Return the pose of the source frame in the target frame: [x, y, z] and the quaternion [x, y, z, w].

        Raise tf.LookupException if a frame is unknown, tf.ConnectivityException if the frames are not connected,
        tf.ExtrapolationException if there is no data for ``time``.
        """
        target, source = strip_leading_slash(target_frame), strip_leading_slash(source_frame)
        return _tuples(self._buffer.lookup_transform(target, source, time))

    def lookupTransformFull(
        self, target_frame: str, target_time: Moment, source_frame: str, source_time: Moment, fixed_frame: str
    ) -> Tuples:
        """Look up a transform like :meth:`lookupTransform`, with a separate time for each frame."""
        target, source, fixed = map(strip_leading_slash, (target_frame, source_frame, fixed_frame))
        return _tuples(self._buffer.lookup_transform_full(target, target_time, source, source_time, fixed))

    def lookupTwist(
        self,
        tracking_frame: str,
        observation_frame: str,
        time: times.Time,
        averaging_interval: times.Duration,
    ) -> tuple[Vector, Vector]:
        """Return the linear (m/s) and angular (rad/s) velocity of ``tracking_frame`` in ``observation_frame``."""
        return self.lookupTwistFull(
            tracking_frame,
            observation_frame,
            observation_frame,
            (0, 0, 0),
            tracking_frame,
            time,
            averaging_interval,
        )

    def lookupTwistFull(
        self,
        tracking_frame: str,
        observation_frame: str,
        reference_frame: str,
        ref_point: Sequence[float],
        reference_point_frame: str,
        time: times.Time,
        averaging_interval: times.Duration,
    ) -> tuple[Vector, Vector]:
        """Return the velocities of ``tracking_frame`` relative to ``observation_frame``, expressed in ``reference_frame``.

        The velocities are those of the origin of ``reference_point_frame``, averaged over ``averaging_interval`` around
        ``time`` (0: until the newest data). ``ref_point`` has no effect, as in real ROS.
        """
        import numpy

        latest = self.getLatestCommonTime(observation_frame, tracking_frame)
        middle = time or latest
        end = min(middle + times.Duration.from_sec(0.5 * averaging_interval.to_sec()), latest)
        start = max(times.Time.from_sec(0.0001) + averaging_interval, end) - averaging_interval
        seconds = (end - start).to_sec()

        start_place, start_turn = self.lookupTransform(observation_frame, tracking_frame, start)
        end_place, end_turn = self.lookupTransform(observation_frame, tracking_frame, end)
        turned = numpy.dot(
            numpy.linalg.inv(transformations.quaternion_matrix(start_turn)),
            transformations.quaternion_matrix(end_turn),
        )
        angle, axis, _ = transformations.rotation_from_matrix(turned)
        speed = (numpy.array(end_place) - start_place) / seconds
        spin = axis * angle / seconds

        # Look up the poses of the tracked frame and of the reference point's frame in the reference frame.
        place, turn = self.lookupTransform(reference_frame, tracking_frame, middle)
        rotation = transformations.quaternion_matrix(turn)[:3, :3]
        angular = numpy.dot(rotation, spin)
        linear = numpy.dot(rotation, speed) + numpy.cross(place, angular)
        point_place, point_turn = self.lookupTransform(reference_frame, reference_point_frame, middle)
        to_point = transformations.concatenate_matrices(
            transformations.translation_matrix(point_place), transformations.quaternion_matrix(point_turn)
        )
        moved = numpy.dot(to_point, (*place, 1.0))[:3] - place
        # As in real ROS, use a dot product, although a cross product would be correct.
        linear = linear + numpy.dot(angular, moved)
        return tuple(linear.tolist()), tuple(angular.tolist())

    def setUsingDedicatedThread(self, value: bool) -> None:
        """Set whether another thread inserts transforms. Only then can a lookup wait for a transform."""
        self._using_dedicated_thread = value

    def getTFPrefix(self) -> str:
        """Return the empty string, because tf2 does not support prefixes."""
        return ""

    def _check_thread(self) -> None:
        if not self._using_dedicated_thread:
            raise TransformException(_WITHOUT_THREAD)

    @staticmethod
    def _raise_unless(result: int | tuple[int, str], source: str, target: str) -> None:
        is_possible, text = result if isinstance(result, tuple) else (result, "")
        if not is_possible:
            raise TransformException(text or f'no such transformation: "{source}" -> "{target}"')


class TransformerROS(Transformer):
    """A Transformer that also transforms stamped messages."""

    def asMatrix(self, target_frame: str, hdr: Header) -> NDArray[numpy.float64]:
        """Return the 4x4 matrix that transforms from a header's frame, at its stamp, to ``target_frame``.

        Raise the same exceptions as lookupTransform.
        """
        return self.fromTranslationRotation(*self.lookupTransform(target_frame, hdr.frame_id, hdr.stamp))

    def fromTranslationRotation(
        self, translation: Sequence[float], rotation: Sequence[float]
    ) -> NDArray[numpy.float64]:
        """Return the 4x4 matrix for a translation (x, y, z) and a quaternion (x, y, z, w)."""
        return transformations.concatenate_matrices(
            transformations.translation_matrix(translation), transformations.quaternion_matrix(rotation)
        )

    def transformPoint(
        self, target_frame: str, ps: geometry_msgs.msg.PointStamped
    ) -> geometry_msgs.msg.PointStamped:
        """Return a point transformed into another frame."""
        point = _moved(self.asMatrix(target_frame, ps.header), ps.point)
        return geometry_msgs.msg.PointStamped(
            _header(target_frame, ps.header), geometry_msgs.msg.Point(*point)
        )

    def transformVector3(
        self, target_frame: str, v3s: geometry_msgs.msg.Vector3Stamped
    ) -> geometry_msgs.msg.Vector3Stamped:
        """Return a vector rotated into another frame."""
        matrix = self.asMatrix(target_frame, v3s.header)
        matrix[:3, 3] = 0.0
        vector = geometry_msgs.msg.Vector3(*_moved(matrix, v3s.vector))
        return geometry_msgs.msg.Vector3Stamped(_header(target_frame, v3s.header), vector)

    def transformQuaternion(
        self, target_frame: str, ps: geometry_msgs.msg.QuaternionStamped
    ) -> geometry_msgs.msg.QuaternionStamped:
        """Return an orientation transformed into another frame."""
        matrix = transformations.concatenate_matrices(
            self.asMatrix(target_frame, ps.header), xyzw_to_mat44(ps.quaternion)
        )
        quaternion = geometry_msgs.msg.Quaternion(*transformations.quaternion_from_matrix(matrix).tolist())
        return geometry_msgs.msg.QuaternionStamped(_header(target_frame, ps.header), quaternion)

    def transformPose(
        self, target_frame: str, ps: geometry_msgs.msg.PoseStamped
    ) -> geometry_msgs.msg.PoseStamped:
        """Return a pose transformed into another frame."""
        matrix = transformations.concatenate_matrices(
            self.asMatrix(target_frame, ps.header),
            xyz_to_mat44(ps.pose.position),
            xyzw_to_mat44(ps.pose.orientation),
        )
        position = transformations.translation_from_matrix(matrix).tolist()
        orientation = transformations.quaternion_from_matrix(matrix).tolist()
        pose = geometry_msgs.msg.Pose(
            geometry_msgs.msg.Point(*position), geometry_msgs.msg.Quaternion(*orientation)
        )
        return geometry_msgs.msg.PoseStamped(_header(target_frame, ps.header), pose)

    def transformPointCloud(
        self, target_frame: str, point_cloud: sensor_msgs.msg.PointCloud
    ) -> sensor_msgs.msg.PointCloud:
        """Return a PointCloud (not PointCloud2) transformed into another frame."""
        matrix = self.asMatrix(target_frame, point_cloud.header)
        # Like real ROS, use 64-bit Points, which have the same fields as Point32.
        points: list[Any] = [geometry_msgs.msg.Point(*_moved(matrix, point)) for point in point_cloud.points]
        return sensor_msgs.msg.PointCloud(
            _header(target_frame, point_cloud.header), points, point_cloud.channels
        )


class TransformListener(TransformerROS):
    """A TransformerROS that inserts the transforms received on /tf and /tf_static.

    The arguments are those of :class:`Transformer`, and the subscribers' ``queue_size``, ``buff_size`` and ``tcp_nodelay``.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        options = {
            key: kwargs.pop(key) for key in ("queue_size", "buff_size", "tcp_nodelay") if key in kwargs
        }
        super().__init__(*args, **kwargs)
        self._listener = Tf2Listener(self._buffer, **options)
        self.setUsingDedicatedThread(True)


def _tuples(message: geometry_msgs.msg.TransformStamped) -> Tuples:
    where, turn = message.transform.translation, message.transform.rotation
    return [where.x, where.y, where.z], [turn.x, turn.y, turn.z, turn.w]


def _header(frame: str, header: Header) -> Header:
    return Header(stamp=header.stamp, frame_id=frame)


def _moved(matrix: NDArray[numpy.float64], point: _Point) -> list[float]:
    import numpy

    moved: list[float] = numpy.dot(matrix, (point.x, point.y, point.z, 1.0))[:3].tolist()
    return moved
