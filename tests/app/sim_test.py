"""Simulated cameras: `sovo camera sim`, `sovo run --world`."""

import json
import struct
import time

import harness
from bus_test import BusTest
from harness import (BAD_INPUT, OK, SMALL_RIG, USAGE, CommandTest, largest_error, read_tum,
                     sovo)

FRAMES = 16


class SimTest(CommandTest):
    def setUp(self):
        super().setUp()
        self.calibration = SMALL_RIG

    def submerge(self):
        """Puts the cameras behind panes, in water."""
        port = "port: {distance: 0.03, thickness: 0.008}}"
        lines = ["water: 1.333" if line.startswith("name:") else
                 line[:-1] + ", " + port if line.endswith("}") else line
                 for line in self.calibration.read_text().splitlines()]
        self.calibration = self.folder / "submerged.yaml"
        self.calibration.write_text("\n".join(lines) + "\n")

    def world(self, name, *options):
        return ("--world", name, "--calib", self.calibration, "--frames", FRAMES, *options)


class SimulatedRun(SimTest):
    def run_world(self, name, *options):
        truth, out = self.folder / "truth.txt", self.folder / "out.txt"
        self.expect(sovo("run", "--deterministic", *self.world(name), "--truth", truth,
                         "--out", out, *options), OK)
        return read_tum(truth), read_tum(out), out.read_bytes()

    def test_true_to_centimetres_and_the_same_again(self):
        truth, poses, first = self.run_world("lawn")
        self.assertEqual([p[0] for p in poses], [p[0] for p in truth])
        self.assertEqual(len(poses), FRAMES)
        self.assertLess(largest_error(poses, truth, poses[0][0]), 0.03)
        self.assertEqual(first, self.run_world("lawn")[2])

    def test_backwards_has_the_stamps_of_the_trajectory(self):
        truth, poses, _ = self.run_world("lawn", "--reverse")
        self.assertEqual([p[0] for p in poses], [p[0] for p in truth])
        # What was fed first is the last of the trajectory.
        self.assertEqual(poses[-1][1:], ([0, 0, 0], [0, 0, 0, 1]))
        self.assertLess(largest_error(poses, truth, poses[-1][0]), 0.03)


class SimulatedFaults(SimTest):
    """What happens to cameras in the field, on the walk over grass at 20 Hz."""

    FRAMES = 90

    def fly(self, **sensor):
        truth, live, scales = (self.folder / n for n in ("truth.txt", "live.txt", "scales.csv"))
        settings = [part for key, value in sensor.items()
                    for part in ("--set", f"sim.sensor.{key}={value}")]
        result = sovo("run", "--deterministic", "--world", "lawn", "--calib", self.calibration,
                      "--frames", self.FRAMES, "--truth", truth, "--out-live", live,
                      "--keyframes", scales, *settings)
        self.expect(result, OK)
        start = float(read_tum(truth)[0][0])
        verdicts = [(float(line.split(",")[0]) - start, line.strip().split(",")[3])
                    for line in scales.read_text().splitlines()[1:]]
        return result.stderr, read_tum(truth), read_tum(live), verdicts

    def test_lost_pairs_lose_nothing_else(self):
        log, truth, live, verdicts = self.fly(drop_rate=0.3)
        self.assertLess(len(live), 0.85 * self.FRAMES)
        self.assertNotIn("LOST", log)
        self.assertLess(largest_error(live, truth, live[0][0]), 0.05)
        self.assertEqual({v for _, v in verdicts}, {"accepted"})

    def test_the_right_camera_goes_dark(self):
        log, truth, live, verdicts = self.fly(dark="right", dark_from_s=1.5, dark_until_s=3)
        self.assertNotIn("LOST", log)
        self.assertEqual(len(live), self.FRAMES)
        self.assertLess(largest_error(live, truth, live[0][0]), 0.05)
        for when, verdict in verdicts:
            dark = 1.5 <= when < 3
            self.assertFalse(dark and verdict == "accepted", f"{verdict} after {when} s")
        self.assertIn("accepted", [v for when, v in verdicts if when > 3.2])

    def test_the_left_camera_goes_dark(self):
        log, truth, live, _ = self.fly(dark="left", dark_from_s=1.5, dark_until_s=2.2)
        self.assertIn("a new segment begins", log)
        start = float(truth[0][0])
        times = [float(p[0]) - start for p in live]
        self.assertEqual([t for t in times if 1.5 <= t < 2.2], [])
        again = [p for p in live if float(p[0]) - start > 3.2]
        self.assertGreater(len(again), 20)
        # The walk of 1.3 m that was not seen goes on, where the new segment begins; that is as true
        # as the old one.
        self.assertLess(largest_error(live, truth, live[0][0]), 0.5)
        self.assertLess(largest_error(again, truth, again[0][0]), 0.05)


class SimulatedExport(SimTest):
    def test_what_is_exported_runs_like_the_world_itself(self):
        folder, out, again = (self.folder / n for n in ("dataset", "out.txt", "again.txt"))
        # A vignette's file has 16 bits; all else comes back to the last bit.
        world = self.world("lawn", "--set", "sim.sensor.vignette=0")
        self.expect(sovo("camera", "sim", *world, "--export", folder, "--depth"), OK)
        images = sorted((folder / "mav0/cam0/data").glob("*.png"))
        self.assertEqual(len(images), FRAMES)
        self.assertEqual(len(list((folder / "depth").glob("*.pfm"))), FRAMES)
        self.expect_depths_of_the_images(folder)
        truth = read_tum(folder / "groundtruth_cam0_tum.txt")
        self.assertEqual(len(truth), FRAMES)
        self.expect(sovo("run", "--deterministic", "--dataset", folder, "--out", out), OK)
        self.expect(sovo("run", "--deterministic", *world, "--out", again), OK)
        self.assertEqual(out.read_bytes(), again.read_bytes())
        report = self.expect(sovo("eval", "--gt", folder / "groundtruth_cam0_tum.txt",
                                  "--est", out), OK)
        self.assertIn("Completion 100.00 %", report.stdout)

    def test_cameras_behind_ports_are_exported_with_them(self):
        folder, out, again = (self.folder / n for n in ("dataset", "out.txt", "again.txt"))
        self.submerge()
        world = self.world("pool", "--set", "sim.sensor.vignette=0")
        self.expect(sovo("camera", "sim", *world, "--export", folder), OK)
        shown = self.expect(sovo("calib", "show", folder), OK).stdout
        self.assertIn("left: behind a flat port, 30.0 mm away and 8.0 mm thick", shown)
        self.expect(sovo("calib", "check", folder, "--dataset", folder, "--pairs", 2), OK)
        self.expect(sovo("run", "--deterministic", "--dataset", folder, "--out", out), OK)
        self.expect(sovo("run", "--deterministic", *world, "--out", again), OK)
        self.assertEqual(out.read_bytes(), again.read_bytes())
        poses, truth = read_tum(out), read_tum(folder / "groundtruth_cam0_tum.txt")
        self.assertEqual(len(poses), FRAMES)
        self.assertLess(largest_error(poses, truth, poses[0][0]), 0.01)
        # EuRoC's own files have cameras without a port that see the same directions.
        sensor = (folder / "mav0/cam0/sensor.yaml").read_text()
        focal = float(sensor.split("intrinsics: [")[1].split(",")[0])
        self.assertAlmostEqual(focal, 1.333 * 175, delta=5)

    def expect_depths_of_the_images(self, folder):
        """The table has the depths of the images at some of their pixels."""
        rows = [line.split(",") for line in (folder / "depth.csv").read_text().splitlines()[1:]]
        self.assertEqual(len(rows), 96 * 2)  # of the first pair and the eleventh
        for stamp, u, v, depth in rows[::37]:
            kind, size, scale, pixels = \
                (folder / "depth" / f"{stamp}.pfm").read_bytes().split(b"\n", 3)
            self.assertEqual((kind, size, scale), (b"Pf", b"320 200", b"-1.0"))
            place = 4 * ((199 - int(v)) * 320 + int(u))  # rows from the bottom
            self.assertAlmostEqual(float(depth), struct.unpack_from("<f", pixels, place)[0],
                                   delta=1e-4 * float(depth))

    def test_start_and_rate_choose_the_pairs(self):
        stamps = {}
        for name, options in {"all": (), "late": ("--start", 4), "slow": ("--rate", 10)}.items():
            folder = self.folder / name
            self.expect(sovo("camera", "sim", "--world", "lawn", "--calib", self.calibration,
                             "--frames", 6, "--export", folder, *options), OK)
            stamps[name] = [float(p[0]) for p in read_tum(folder / "groundtruth_cam0_tum.txt")]
        self.assertEqual(stamps["late"][:2], stamps["all"][4:])
        self.assertAlmostEqual(stamps["slow"][1] - stamps["slow"][0], 0.1, places=6)


class SimulatedRefusals(SimTest):
    def refused(self, code, words, *arguments):
        result = self.expect(sovo(*arguments), code)
        for word in words:
            self.assertIn(word, result.stderr)

    def test_reasons(self):
        self.refused(USAGE, ["desert", "lawn"], "camera", "sim", "--world", "desert")
        self.refused(USAGE, ["--export"], "camera", "sim", "--depth")
        self.refused(USAGE, ["fast", "Hz"], "camera", "sim", "--rate", "fast")
        self.refused(USAGE, ["--dataset", "--world"], "run")
        self.refused(USAGE, ["--dataset", "--world", "leave one out"], "run", "--world", "lawn",
                     "--dataset", self.folder)
        self.refused(USAGE, ["/nowhere does not exist"], "camera", "sim", *self.world("lawn"),
                     "--truth", "/nowhere/truth.txt")
        self.refused(BAD_INPUT, ["/nowhere.txt", "town", "expressway"], "run", "--world", "street",
                     "--trajectory", "/nowhere.txt")
        self.refused(BAD_INPUT, ["no pair 100000"], "run", "--world", "hall", "--start", 100000)
        self.refused(USAGE, ["/nowhere does not exist"], "run", *self.world("lawn"),
                     "--truth", "/nowhere/truth.txt")


class SyntheticBench(SimTest):
    def test_a_row_a_case_and_the_numbers_as_json(self):
        numbers = self.folder / "bench.json"
        result = self.expect(sovo("bench", "synthetic", "--only", "lawn/square", "--calib",
                                  self.calibration, "--frames", FRAMES, "--runs", 2,
                                  "--json", numbers), OK)
        lines = result.stdout.splitlines()
        self.assertIn("ynthetic", lines[0])
        self.assertEqual([line.split()[0] for line in lines[1:]],
                         ["world/trajectory", "lawn/square", "lawn/square", "all,"])
        runs = json.loads(numbers.read_text())
        # Of two runs the median is the mean.
        mean_ate = sum(run["ate_m"] for run in runs) / 4
        self.assertEqual(lines[-1].split()[3], str(2 * FRAMES))
        self.assertAlmostEqual(float(lines[-1].split()[7]), mean_ate, delta=1e-4)
        self.assertEqual([(r["case"], r["seed"]) for r in runs],
                         [("lawn/square", 1), ("lawn/square", 2),
                          ("lawn/square <", 1), ("lawn/square <", 2)])
        for run in runs:
            self.assertEqual(run["frames"], FRAMES)
            self.assertEqual(run["completion"], 1.0)
            self.assertLess(run["ate_m"], 0.02)
            self.assertGreater(run["frame_ms"], 0.0)

    def test_unknown_case_names_the_known(self):
        result = self.expect(sovo("bench", "synthetic", "--only", "desert"), USAGE)
        self.assertIn("street/expressway <", result.stderr)


class SimulatedBus(SimTest, BusTest):
    def test_camera_and_odometry_as_processes(self):
        self.camera_and_odometry("lawn", 0.05)

    def test_ports_go_along_with_the_calibration(self):
        self.submerge()
        self.camera_and_odometry("pool", 0.01)

    def camera_and_odometry(self, world, most):
        truth, live = self.folder / "truth.txt", self.folder / "live.txt"
        vo = self.start("vo", "--frames", FRAMES, "--out-live", live)
        self.expect(sovo("camera", "sim", *self.bus, *self.world(world), "--rate", "max",
                         "--restamp", "--truth", truth), OK)
        _, log = self.finish(vo)
        poses, true_poses = read_tum(live), read_tum(truth)
        self.assertEqual(len(poses), FRAMES, log)
        self.assertLess(abs(float(poses[0][0]) - time.time()), 600)
        self.assertLess(largest_error(poses, true_poses, poses[0][0]), most)

    def test_a_line_of_state_with_scale_and_drift(self):
        truth = self.folder / "truth.txt"
        self.start("vo")
        # Long enough that a slow machine finds it still running; it is ended with the test.
        self.start("camera", "sim", "--world", "lawn", "--calib", self.calibration,
                   "--frames", 120, "--rate", 4, "--restamp", "--truth", truth)
        deadline = time.time() + 120
        while not truth.exists() and time.time() < deadline:
            time.sleep(0.1)
        status = self.expect(sovo("status", "--line", "--once", "--truth", truth, *self.bus), OK)
        self.assertRegex(status.stdout, r"^frame \d+ of 120, .* Hz, latency \d+ ms, \w+, ")
        for word in ("points", "scale", "+-", "drift 0.0"):
            self.assertIn(word, status.stdout)


if __name__ == "__main__":
    harness.main()
