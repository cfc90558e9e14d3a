"""Flights that a direct method dislikes, as poses of the vehicle over time."""

import math


def eased(t, begin, end):
    """From 0 to 1, with velocity and acceleration 0 at both ends."""
    u = min(1.0, max(0.0, (t - begin) / (end - begin)))
    return u * u * u * (u * (6 * u - 15) + 10)


def turned(yaw, pitch=0.0):
    """Quaternion x y z w of a vehicle (x forward, y left, z up) [rad]."""
    cy, sy, cp, sp = (f(0.5 * a) for a in (yaw, pitch) for f in (math.cos, math.sin))
    return [-sy * sp, cy * sp, sy * cp, cy * cp]


def restless(t, halt):
    """Loops with turns of up to 110 deg/s and 2.5 m/s, which end in a halt within 0.6 s."""
    braked = min(1.0, max(0.0, (t - halt) / 0.6))
    a = 2 * math.pi / 2.6 * (min(t, halt) + 0.3 * (1 - (1 - braked) ** 2))
    return ([0.9 * math.sin(2 * a), 1.2 * math.sin(a), 0.3 * math.sin(2 * a)],
            turned(math.radians(45) * math.sin(a), math.radians(15) * math.sin(1.7 * a)))


def turn_on_the_spot(t):
    """By 80 degrees and back, between two moves."""
    return ([eased(t, 0, 2) + eased(t, 6, 8), 0, 0],
            turned(math.radians(80) * (eased(t, 2, 4) - eased(t, 4, 6))))


def nothing_but_turning(t):
    """40 degrees to either side."""
    return [0, 0, 0], turned(math.radians(40) * math.sin(math.pi * t / 3))


def knocked(t):
    """On a gentle curve, with a blow every 0.6 s that turns it by up to 15 degrees within 60 ms."""
    def leaned(k):
        if k < 1:
            return 0.0, 0.0
        return math.radians(9) * math.sin(2.4 * k), math.radians(7) * math.cos(1.7 * k)
    blow = math.floor(t / 0.6)
    share = eased(t - 0.6 * blow, 0, 0.06)
    yaw, pitch = (a + share * (b - a) for a, b in zip(leaned(blow - 1), leaned(blow)))
    return ([1.5 * math.sin(0.5 * t), 1.2 * math.sin(0.9 * t), 0.2 * math.sin(0.7 * t)],
            turned(yaw + 0.2 * math.sin(0.6 * t), pitch))


def rest_then_hovering(t):
    """From rest after two seconds, then within 5 cm and 3 degrees of there."""
    share = eased(t, 2, 4)
    at = [.05 * math.sin(.9 * t) + .02 * math.sin(2.3 * t), .04 * math.sin(.7 * t),
          .03 * math.sin(1.1 * t)]
    return [share * x for x in at], turned(share * .05 * math.sin(.5 * t))


def rest_motion_rest(t):
    """From rest after half a second, to rest again after three."""
    return [1.5 * eased(t, 0.5, 3), 0.8 * eased(t, 0.5, 3), 0], turned(0)


def write_trajectory(path, pose, seconds):
    """Writes a TUM file of the poses `pose(t)`, fifty a second."""
    with open(path, "w") as file:
        for i in range(round(50 * seconds) + 1):
            position, rotation = pose(0.02 * i)
            numbers = " ".join(f"{v:.9f}" for v in [*position, *rotation])
            file.write(f"{1.6e9 + 0.02 * i:.2f} {numbers}\n")
