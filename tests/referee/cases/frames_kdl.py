"""PyKDL's frame types, and tf_conversions for them."""

import copy
import math
import pickle
import random

import geometry_msgs.msg
import numpy
import PyKDL
import tf_conversions
import tf_conversions.posemath as posemath
from referee import outcome, show
from tf_conversions import transformations


def near(value):
    """Return numbers of any type as a string, rounded."""
    if isinstance(value, float):
        return f"{round(value, 9) + 0.0:.9f}"
    if isinstance(value, (tuple, list)):
        return [near(each) for each in value]
    if isinstance(value, PyKDL.Vector):
        return near([value[n] for n in range(3)])
    if isinstance(value, PyKDL.Rotation):
        return near([value[r, c] for r in range(3) for c in range(3)])
    if isinstance(value, PyKDL.Frame):
        return near([value[r, c] for r in range(3) for c in range(4)])
    if isinstance(value, (PyKDL.Twist, PyKDL.Wrench)):
        return near([value[n] for n in range(6)])
    return value


rng = random.Random(5)


def vector():
    return PyKDL.Vector(*(rng.uniform(-3, 3) for _ in range(3)))


def rotation():
    return PyKDL.Rotation.RPY(*(rng.uniform(-3, 3) for _ in range(3)))


a, b = PyKDL.Vector(1, 2, 3), PyKDL.Vector(-4, 5.5, 0.125)
show(a, b, a + b, a - b, -a, a * b, a * 2, 2 * a, a / 2, a == b, a == PyKDL.Vector(a), a != b)
show(near(a.Norm()), PyKDL.dot(a, b), a.x(), a.y(), a.z(), a[0], a[2], PyKDL.Vector(), PyKDL.Vector.Zero())
c = PyKDL.Vector(a)
c[1] = 7
c.x(9)
c += b
c -= a
c.ReverseSign()
show(
    c, near(c.Normalize()), near(c), PyKDL.Vector(0, 0, 0).Norm(), near(PyKDL.Vector(1e-9, 0, 0).Normalize())
)
show(repr(a), str(a), copy.copy(a), copy.deepcopy(a), pickle.loads(pickle.dumps(a)))
outcome("index", lambda: a[3])
outcome("negative index", lambda: a[-1])

for _ in range(8):
    r, s, v, w = rotation(), rotation(), vector(), vector()
    f, g = PyKDL.Frame(r, v), PyKDL.Frame(s, w)
    t, u = PyKDL.Twist(v, w), PyKDL.Wrench(w, v)
    show("rotation", near(r), near(r * s), near(r * v), near(r.Inverse()), near(r.Inverse(v)))
    show(near(r.GetRPY()), near(r.GetQuaternion()), near(r.GetEulerZYX()), near(r.GetEulerZYZ()))
    show(near(r.GetRot()), near(r.GetRotAngle()), near(r.UnitX()), near(r.UnitY()), near(r.UnitZ()))
    show(near(PyKDL.Rotation.Quaternion(*s.GetQuaternion())), near(PyKDL.Rotation.Rot(v, 0.7)))
    show(near(PyKDL.Rotation.EulerZYX(0.1, 0.2, 0.3)), near(PyKDL.Rotation.EulerZYZ(0.1, 0.2, 0.3)))
    show(
        "frame",
        near(f),
        near(f * g),
        near(f * v),
        near(f.Inverse()),
        near(f.Inverse(w)),
        near(f.M),
        near(f.p),
    )
    show(
        "twist",
        near(f * t),
        near(r * t),
        near(f.Inverse(t)),
        near(t.RefPoint(w)),
        near(t * 2),
        near(-t),
        near(t + t),
    )
    show(
        "wrench", near(f * u), near(r * u), near(f.Inverse(u)), near(u.RefPoint(w)), near(u / 2), near(u - u)
    )
    show(
        near(PyKDL.dot(t, u)), near(PyKDL.dot(u, t)), near(t.vel), near(t.rot), near(u.force), near(u.torque)
    )
    show("delta", near(PyKDL.diff(v, w)), near(PyKDL.diff(r, s)), near(PyKDL.diff(f, g, 0.5)))
    show(
        near(PyKDL.addDelta(f, PyKDL.diff(f, g))),
        near(PyKDL.addDelta(r, v, 0.1)),
        near(PyKDL.addDelta(v, w, 2)),
    )
    show(near(PyKDL.Frame.DH(0.1, 0.2, 0.3, 0.4)), near(PyKDL.Frame.DH_Craig1989(0.1, 0.2, 0.3, 0.4)))
    moved = PyKDL.Frame(f)
    moved.Integrate(t, 10)
    show(near(moved), PyKDL.Equal(f, moved), PyKDL.Equal(f, PyKDL.Frame(f)), f == PyKDL.Frame(f), f == g)
    show("posemath", near(list(posemath.toTf(f)[0])), near(list(posemath.toTf(f)[1])))
    show(near(posemath.fromTf(posemath.toTf(f))), near(posemath.fromMsg(posemath.toMsg(f))))
    show(near(posemath.toMatrix(f).tolist()), near(posemath.fromMatrix(posemath.toMatrix(f))))
    show(
        near(tf_conversions.toMatrix(f)[0].tolist()),
        near(transformations.euler_from_matrix(posemath.toMatrix(f))),
    )

for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, -1), (-1, 2, 3)):
    for angle in (0.0, math.pi, math.pi / 2, -math.pi / 2, 3.1, 1e-8):
        r = PyKDL.Rotation.Rot(PyKDL.Vector(*axis), angle)
        show(axis, near(angle), near(r.GetQuaternion()), near(r.GetRPY()), near(list(r.GetEulerZYZ())))

r = PyKDL.Rotation(1, 2, 3, 4, 5, 6, 7, 8, 9)
r[0, 1] = 10
show(r, r[2, 0], PyKDL.Rotation(), PyKDL.Rotation.Identity() == PyKDL.Rotation())
show(PyKDL.Rotation(a, b, a), PyKDL.Rotation.RotX(0.5), PyKDL.Rotation.RotY(0.5), PyKDL.Rotation.RotZ(0.5))
r.DoRotX(0.1)
r.DoRotY(0.2)
r.DoRotZ(0.3)
r.UnitX(PyKDL.Vector(1, 0, 0))
show(near(r))
r.SetInverse()
show(
    near(r),
    repr(PyKDL.Frame(PyKDL.Rotation.RotZ(0.5), a)),
    PyKDL.Frame(a),
    PyKDL.Frame(PyKDL.Rotation.RotZ(1)),
)
f = PyKDL.Frame()
f[1, 3] = 5
f[0, 0] = 3
f.p = a
show(f, f[1, 3], f.p[2], PyKDL.Frame.Identity(), copy.deepcopy(f) == f)
outcome("index of a rotation", lambda: r[3, 0])
outcome("index of a frame", lambda: f[3, 3])
t = PyKDL.Twist(a, b)
t[4] = 1
show(t, t[0], PyKDL.Twist(), PyKDL.Wrench.Zero(), PyKDL.Wrench(a, b), t == PyKDL.Twist(t), t != PyKDL.Twist())
outcome("index of a twist", lambda: t[6])
PyKDL.SetToZero(t)
show(t, PyKDL.Equal(a, b), PyKDL.Equal(a, a + PyKDL.Vector(0.01, 0, 0), 0.1))
pose = geometry_msgs.msg.Pose()
pose.orientation.w = 1.0
pose.position.x = 2.0
show(near(tf_conversions.fromMsg(pose)), numpy.allclose(posemath.toMatrix(posemath.fromMsg(pose))[0, 3], 2.0))
