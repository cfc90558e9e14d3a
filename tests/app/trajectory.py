"""Trajectories as the tests of the command see them."""

import math
import pathlib


def read_tum(path):
    """Lines of a TUM file as (stamp text, position, quaternion x y z w)."""
    poses = []
    for line in pathlib.Path(path).read_text().splitlines():
        if not line or line.startswith("#"):
            continue
        fields = line.split()
        numbers = [float(f) for f in fields[1:]]
        poses.append((fields[0], numbers[:3], numbers[3:]))
    return poses


def rotate_back(q, v):
    """Rotation by the inverse of q = x y z w."""
    x, y, z, w = -q[0], -q[1], -q[2], q[3]
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1],
            v[1] + w * t[1] + z * t[0] - x * t[2],
            v[2] + w * t[2] + x * t[1] - y * t[0]]


def largest_error(estimate, truth, origin):
    """Largest distance between positions [m], both seen from the pose at stamp `origin`."""
    true_poses = {stamp: (p, q) for stamp, p, q in truth}
    estimated = {stamp: (p, q) for stamp, p, q in estimate}
    p0, q0 = true_poses[origin]
    e0, r0 = estimated[origin]
    worst = 0.0
    for stamp, p, _ in estimate:
        true_p = true_poses[stamp][0]
        expected = rotate_back(q0, [a - b for a, b in zip(true_p, p0)])
        seen = rotate_back(r0, [a - b for a, b in zip(p, e0)])
        worst = max(worst, math.dist(expected, seen))
    return worst


def largest_step_error(estimate, truth):
    """Largest error of the way from one pose to the next [m]; both have the same stamps."""
    ways = [[math.dist(a[1], b[1]) for a, b in zip(poses, poses[1:])]
            for poses in (estimate, truth)]
    return max(abs(a - b) for a, b in zip(*ways))
