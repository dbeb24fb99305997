// The definitions of the messages that the 3D view publishes. Pure.

const LINE = "=".repeat(80);
const DEFINITIONS = {
  "std_msgs/Header": "uint32 seq\ntime stamp\nstring frame_id",
  "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
  "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
  "geometry_msgs/Pose": "Point position\nQuaternion orientation",
  "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
  "geometry_msgs/Twist": "Vector3 linear\nVector3 angular",
  "geometry_msgs/PoseWithCovariance": "Pose pose\nfloat64[36] covariance",
};

/** Return a definition with those that it uses, as a bridge wants it. */
export const schema = (own) =>
  [own, ...Object.entries(DEFINITIONS).map(([name, text]) => `MSG: ${name}\n${text}`)].join(`\n${LINE}\n`);
