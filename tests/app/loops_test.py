"""Loop closing: `sovo run --loops`, `sovo vo --loops`."""

import json
import math

import harness
from bus_test import BusTest
from flights import turned, write_trajectory
from harness import OK, SMALL_RIG, USAGE, CommandTest, read_tum, sovo

LAP_S = 5.0


def laps(t):
    """Around in five seconds, looking about; each lap a little beside the one before."""
    a = 2 * math.pi * t / LAP_S
    return ([1.4 * math.sin(a), 1.2 * math.cos(a), 0.15 * math.sin(2 * a) + 0.01 * t],
            turned(math.radians(35) * math.sin(a), math.radians(8) * math.sin(2 * a)))


def laps_and_a_leap(t):
    """The same; from one frame to the next it goes on elsewhere, and comes back by itself."""
    return laps(t if t < 1.3 * LAP_S else t + 0.4 * LAP_S)


class LoopTest(CommandTest):
    def fly(self, pose, seconds, *options, settings=(), stem="a"):
        path = self.folder / "trajectory.txt"
        write_trajectory(path, pose, seconds)
        self.truth_file, self.out, self.map = (
            self.folder / f"{stem}_{name}.txt" for name in ("truth", "out", "map"))
        arguments = ["run", "--deterministic", "--world", "hall", "--calib", SMALL_RIG,
                     "--trajectory", path, "--set", "sim.trajectory_body=base",
                     "--truth", self.truth_file, "--out", self.out, *options]
        for setting in settings:
            arguments += ["--set", setting]
        return self.expect(sovo(*arguments), OK)

    def error(self, estimate):
        """Root mean square of the positions' errors after the best rigid motion [m]."""
        report = self.folder / "report.json"
        self.expect(sovo("eval", "--gt", self.truth_file, "--est", estimate, "--json", report), OK)
        return json.loads(report.read_text())["ate_se3_m"]["rmse"]

    def loops(self, result):
        line = next(one for one in result.stdout.splitlines() if one.startswith("loops closed"))
        return int(line.split()[2])


class Loops(LoopTest):
    def test_a_second_lap_takes_the_drift_away_and_leaves_the_odometry_alone(self):
        # With few points it drifts enough to tell: 11.8 mm, by the loops 6.2.
        few = ("vo.points.active_points=100", "vo.points.immature_points=50", "seed=4")
        self.fly(laps, 2 * LAP_S, settings=few, stem="without")
        without = self.out.read_bytes()
        result = self.fly(laps, 2 * LAP_S, "--loops", "--out-map", self.folder / "map.txt",
                          settings=few)
        self.assertGreater(self.loops(result), 5)
        self.assertEqual(self.out.read_bytes(), without)
        self.assertEqual([p[0] for p in read_tum(self.folder / "map.txt")],
                         [p[0] for p in read_tum(self.out)])
        self.assertLess(self.error(self.folder / "map.txt"), 0.7 * self.error(self.out))
        again = self.folder / "again.txt"
        self.fly(laps, 2 * LAP_S, "--loops", "--out-map", again, settings=few, stem="again")
        self.assertEqual(again.read_bytes(), (self.folder / "map.txt").read_bytes())

    def test_what_was_lost_is_found_again(self):
        corrected = self.folder / "map.txt"
        result = self.fly(laps_and_a_leap, 2.6 * LAP_S, "--loops", "--out-map", corrected)
        self.assertIn("a new segment begins", result.stderr)
        self.assertIn("loop closed", result.stderr)
        self.assertGreater(self.error(self.out), 0.3)
        self.assertLess(self.error(corrected), 0.05)

    def test_without_a_loop_nothing_is_corrected(self):
        corrected = self.folder / "map.txt"
        result = self.fly(laps, 0.4 * LAP_S, "--loops", "--out-map", corrected)
        self.assertEqual(self.loops(result), 0)
        self.assertEqual(corrected.read_bytes(), self.out.read_bytes())

    def test_what_cannot_be_is_refused_before_the_work(self):
        def refused(*options):
            return self.expect(sovo("run", "--world", "hall", *options), USAGE).stderr
        self.assertIn("needs loops.enabled (--loops)", refused("--out-map", self.folder / "m.txt"))
        self.assertIn("mode scale or stereo", refused("--loops", "--mode", "mono"))
        self.assertIn("min_inliers", refused("--loops", "--set", "loops.matching.min_inliers=3"))
        self.assertIn("does not exist",
                      refused("--loops", "--out-map", self.folder / "none" / "m.txt"))


class LoopsOnTheBus(BusTest):
    def test_map_and_its_path_are_published(self):
        trajectory, out, corrected = (self.folder / n for n in ("t.txt", "out.txt", "map.txt"))
        write_trajectory(trajectory, laps, 2 * LAP_S)
        vo = self.start("vo", "--loops", "--deterministic", "--idle-exit", 5, "--out", out, "--out-map", corrected)
        path = self.start("topic", "echo", "map_path", "--json")
        transforms = self.start("topic", "echo", "/tf", "--json")
        self.expect(sovo("camera", "sim", "--world", "hall", "--calib", SMALL_RIG, "--rate", "max",
                         "--trajectory", trajectory, "--set", "sim.trajectory_body=base",
                         *self.bus), OK)
        summary, _ = self.finish(vo)
        self.assertGreater(int(summary.split("loops closed")[1].split()[0]), 2)
        for process in (path, transforms):
            process.terminate()
        paths = [json.loads(line) for line in path.communicate()[0].splitlines()]
        self.assertGreater(len(paths), 2)
        self.assertTrue(paths[-1]["header"]["frame_id"].endswith("/map"))
        self.assertGreater(len(paths[-1]["poses"]), 10)
        frames = [(t["header"]["frame_id"].split("/")[-1], t["child_frame_id"].split("/")[-1])
                  for line in transforms.communicate()[0].splitlines()
                  for t in json.loads(line)["transforms"]]
        # One of each for every metric pose; their writers are found one after the other.
        self.assertAlmostEqual(frames.count(("map", "odom")), frames.count(("odom", "base_link")),
                               delta=10)
        self.assertGreater(frames.count(("map", "odom")), 50)


if __name__ == "__main__":
    harness.main()
