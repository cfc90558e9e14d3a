"""`sovo run`: source and odometry in one process."""

import json
import os
import pathlib
import platform
import re
import shutil
import signal
import time
import unittest

import harness
from harness import (BAD_INPUT, DATASET, FAILED, OK, SHARED, CommandTest, largest_error, read_tum,
                     sovo, start)

FRAMES = 40
TRUTH = pathlib.Path(DATASET) / "groundtruth_cam0_tum.txt"
# The rendered camera moves 0.75 m.
TOLERANCE_M = 0.03


def widest_lanes():
    """What the inner loops take on this processor."""
    if platform.machine() != "x86_64":
        return "neon"
    flags = set(re.search(r"^flags\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text(),
                          re.MULTILINE).group(1).split())
    if {"avx512vl", "avx512dq", "avx512bw"} <= flags:
        return "avx512"
    return "avx2" if "avx2" in flags else "sse"


class Accuracy(CommandTest):
    def run_with(self, *options):
        out = self.folder / "out.txt"
        self.expect(sovo("run", "--dataset", DATASET, "--rate", "max", "--out", out, *options), OK)
        return read_tum(out)

    def test_forward(self):
        poses = self.run_with()
        self.assertEqual(len(poses), FRAMES)
        self.assertEqual(poses[0][1:], ([0, 0, 0], [0, 0, 0, 1]))
        self.assertLess(largest_error(poses, read_tum(TRUTH), poses[0][0]), TOLERANCE_M)

    def test_deterministic(self):
        poses = self.run_with("--deterministic")
        self.assertEqual(len(poses), FRAMES)
        self.assertLess(largest_error(poses, read_tum(TRUTH), poses[0][0]), TOLERANCE_M)

    def test_mode_stereo(self):
        keyframes = self.folder / "keyframes.csv"
        poses = self.run_with("--deterministic", "--mode", "stereo", "--keyframes", keyframes)
        self.assertEqual(len(poses), FRAMES)
        self.assertLess(largest_error(poses, read_tum(TRUTH), poses[0][0]), TOLERANCE_M)
        rows = [line.split(",") for line in keyframes.read_text().splitlines()[1:]]
        self.assertTrue(rows)
        # The optimizer watches, and finds nothing to correct.
        self.assertEqual({(float(row[1]), row[3]) for row in rows}, {(0.0, "accepted")})

    def test_mode_stereo_is_deterministic_too(self):
        a = self.run_with("--deterministic", "--mode", "stereo", "--threads", 1)
        b = self.run_with("--deterministic", "--mode", "stereo", "--threads", 2)
        self.assertEqual(a, b)

    def test_backend_features(self):
        live = self.run_with("--backend", "features")
        self.assertEqual(len(live), FRAMES)
        self.assertLess(largest_error(live, read_tum(TRUTH), live[0][0]), TOLERANCE_M)
        a, b = (self.run_with("--deterministic", "--backend", "features", "--threads", n)
                for n in (1, 2))
        self.assertEqual(a, b)
        self.assertLess(largest_error(a, read_tum(TRUTH), a[0][0]), TOLERANCE_M)

    def test_backend_features_finds_the_scale_of_two_views(self):
        poses = self.run_with("--deterministic", "--backend", "features", "--init", "two_view")
        # The dataset begins slowly: so much of it shows parallax enough, whatever the backend.
        self.assertGreater(len(poses), 0.4 * FRAMES)
        self.assertLess(largest_error(poses, read_tum(TRUTH), poses[0][0]), TOLERANCE_M)

    def test_reverse_writes_the_stamps_of_the_dataset(self):
        poses = self.run_with("--reverse", "--deterministic")
        stamps = [stamp for stamp, _, _ in poses]
        self.assertEqual(stamps, [stamp for stamp, _, _ in read_tum(TRUTH)])
        # The frame that was fed first is the last of the dataset.
        self.assertEqual(poses[-1][1:], ([0, 0, 0], [0, 0, 0, 1]))
        self.assertLess(largest_error(poses, read_tum(TRUTH), stamps[-1]), TOLERANCE_M)


class Determinism(CommandTest):
    def outputs(self, name, *options):
        files = [self.folder / f"{name}.{kind}" for kind in ("tum", "live", "csv")]
        self.expect(sovo("run", "--dataset", DATASET, "--deterministic", "--rate", "max",
                         "--out", files[0], "--out-live", files[1], "--keyframes", files[2],
                         *options), OK)
        return [f.read_bytes() for f in files]

    def test_same_bytes_again_and_with_any_number_of_threads(self):
        first = self.outputs("first", "--threads", 1)
        self.assertTrue(all(first))
        self.assertEqual(first, self.outputs("again", "--threads", 1))
        self.assertEqual(first, self.outputs("two", "--threads", 2))
        self.assertEqual(first, self.outputs("two_again", "--threads", 2))


class Outputs(CommandTest):
    def test_files_and_summary(self):
        names = {"--out": "out.txt", "--out-live": "live.txt", "--keyframes": "kf.csv",
                 "--profile": "profile.json"}
        files = [str(x) for option, name in names.items() for x in (option, self.folder / name)]
        several_keyframes = ["--set", "vo.keyframe.flow_translation=0.08"]
        result = self.expect(sovo("run", "--dataset", DATASET, "--rate", "max", "--frames", 20,
                                  "--start", 5, *several_keyframes, *files), OK)
        for word in ("frames fed       20", "frames tracked   20 (100.0 %)", "states           20 TRACKING",
                     "scale verdicts", "bundle_adjustment"):
            self.assertIn(word, result.stdout)
        truth = [stamp for stamp, _, _ in read_tum(TRUTH)]
        for name in ("out.txt", "live.txt"):
            stamps = [stamp for stamp, _, _ in read_tum(self.folder / name)]
            self.assertEqual(stamps, truth[5:25])
        self.check_keyframes((self.folder / "kf.csv").read_text().splitlines())
        self.check_profile(json.loads((self.folder / "profile.json").read_text()))

    def check_keyframes(self, lines):
        self.assertEqual(lines[0], "stamp,correction,sigma,verdict")
        self.assertGreater(len(lines), 1)
        for line in lines[1:]:
            self.assertRegex(line, r"^\d+\.\d{9},[^,]+,[^,]+,\w+$")

    def check_profile(self, profile):
        names = ["frame", "undistortion", "pyramid", "tracking", "tracing", "selection",
                 "static_matching", "bundle_adjustment", "marginalization", "scale_optimization"]
        self.assertEqual(list(profile["stages"]), names)
        for name in names:
            self.assertEqual(set(profile["stages"][name]),
                             {"count", "mean_ms", "median_ms", "p95_ms"})
        self.assertEqual(profile["stages"]["frame"]["count"], 20)
        counters = profile["counters"]
        self.assertEqual(counters["frames"], 20)
        self.assertGreater(counters["points"], 100)
        self.assertGreater(counters["residuals"], counters["points"])
        self.assertEqual(counters["keyframes_per_frame"], counters["keyframes"] / 20)
        self.assertGreater(profile["peak_memory_mb"], 1)
        self.assertEqual(profile["threads"], 2)
        self.assertEqual(profile["kernels"], widest_lanes())


class Interrupt(CommandTest):
    def test_sigint_ends_cleanly_with_the_trajectory_written(self):
        out = self.folder / "out.txt"
        process = start("run", "--dataset", DATASET, "--rate", "0.1", "--out", out)
        self.wait_for_line(process.stderr, "frames")
        time.sleep(3)
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=60)
        self.assertEqual(process.returncode, OK, stderr)
        self.assertIn("frames tracked", stdout)
        self.assertTrue(0 < len(read_tum(out)) < FRAMES)


class BadFrames(CommandTest):
    """Damaged recordings: a report, no crash, and the other frames are tracked."""

    def damaged(self):
        copy = self.folder / "damaged"
        shutil.copytree(DATASET, copy)
        return copy, sorted((copy / "mav0/cam0/data").iterdir())

    def run_on(self, dataset):
        out = self.folder / "out.txt"
        result = sovo("run", "--dataset", dataset, "--rate", "max", "--out", out)
        self.assertIn(result.returncode, (OK, FAILED, BAD_INPUT), result.stderr)
        return result, read_tum(out) if out.exists() else []

    def test_unreadable_left_image(self):
        dataset, left = self.damaged()
        left[20].write_bytes(b"not an image")
        result, poses = self.run_on(dataset)
        self.assertEqual(result.returncode, OK)
        self.assertIn(left[20].name, result.stderr)
        self.assertGreaterEqual(len(poses), FRAMES - 3)

    def test_missing_right_image(self):
        dataset, left = self.damaged()
        (dataset / "mav0/cam1/data" / left[20].name).unlink()
        result, poses = self.run_on(dataset)
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assertGreaterEqual(len(poses), FRAMES - 3)

    def test_image_of_another_size(self):
        dataset, left = self.damaged()
        pgm = b"P5 16 16 255\n" + bytes(range(256))
        left[20].write_bytes(pgm)
        result, poses = self.run_on(dataset)
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assertGreaterEqual(len(poses), FRAMES - 3)
        self.assertRegex(result.stderr, "16.?x.?16|size")

    def test_image_of_zeros(self):
        dataset, left = self.damaged()
        left[20].write_bytes(b"P5 320 240 255\n" + bytes(320 * 240))
        result, poses = self.run_on(dataset)
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assertGreaterEqual(len(poses), FRAMES - 3)

    def test_all_images_black_is_a_failed_job(self):
        dataset, _ = self.damaged()
        for image in (dataset / "mav0").glob("cam*/data/*.png"):
            image.write_bytes(b"P5 320 240 255\n" + bytes(320 * 240))
        result, poses = self.run_on(dataset)
        self.assertEqual(result.returncode, FAILED)
        self.assertEqual(poses, [])


class RecordedClips(CommandTest):
    """Real sequences, where they are at hand."""

    def complete(self, name, *options):
        dataset = SHARED / "data" / name
        if not dataset.is_dir():
            raise unittest.SkipTest(f"SKIPPED: no recording at {dataset} (set SOVO_SHARED)")
        profile = self.folder / "profile.json"
        result = self.expect(sovo("run", "--dataset", dataset, "--deterministic", "--rate", "max",
                                  "--profile", profile, *options), OK)
        self.assertIn("(100.0 %)", result.stdout)
        return json.loads(profile.read_text())

    def test_euroc_from_stereo_depth(self):
        profile = self.complete("euroc/MH_01_head", "--frames", 60, "--init", "stereo")
        if os.environ.get("SOVO_SANITIZED") != "1":
            self.assertLess(profile["peak_memory_mb"], 150)

    def test_kitti(self):
        self.complete("kitti/sequences/06", "--frames", 30)

    def thinned_euroc(self, start, step, frames):
        """Every step-th pair."""
        return self.part_of_euroc(f"euroc_{start}_{step}",
                                  lambda i: start <= i < frames and (i - start) % step == 0)

    def part_of_euroc(self, name, is_kept):
        """The pairs whose number is kept, as a sequence of its own."""
        source = SHARED / "data/euroc/MH_01_head/mav0"
        if not source.is_dir():
            raise unittest.SkipTest(f"SKIPPED: no recording at {source} (set SOVO_SHARED)")
        for camera in ("cam0", "cam1"):
            folder = self.folder / name / "mav0" / camera
            (folder / "data").mkdir(parents=True)
            shutil.copy(source / camera / "sensor.yaml", folder)
            head, *rows = (source / camera / "data.csv").read_text().splitlines()
            kept = [row for i, row in enumerate(rows) if is_kept(i)]
            (folder / "data.csv").write_text("\n".join([head, *kept]) + "\n")
            for row in kept:
                image = row.split(",")[1].strip()
                (folder / "data" / image).symlink_to(source / camera / "data" / image)
        return self.folder / name

    def test_a_third_of_the_pairs_while_the_camera_turns(self):
        self.complete(self.thinned_euroc(0, 3, 60))

    def test_a_frame_that_hardly_fits_waits_for_no_sharper_one(self):
        # Five of them were lost while a keyframe was put off for blur.
        self.complete(self.thinned_euroc(3, 4, 60))

    def thinned_kitti(self, sequence, start, step):
        """Every step-th pair."""
        return self.part_of_kitti(sequence, f"{sequence}_{start}_{step}",
                                  lambda i: i >= start and (i - start) % step == 0)

    def part_of_kitti(self, sequence, name, is_kept):
        """The pairs whose number is kept, with times and poses, as a sequence of its own."""
        source = SHARED / "data/kitti/sequences" / sequence
        if not source.is_dir():
            raise unittest.SkipTest(f"SKIPPED: no recording at {source} (set SOVO_SHARED)")
        folder = self.folder / name
        folder.mkdir()

        def kept(things):
            return [thing for i, thing in enumerate(things) if is_kept(i)]

        shutil.copy(source / "calib.txt", folder)
        poses = SHARED / "data/kitti/poses" / f"{sequence}.txt"
        for file, name in ((source / "times.txt", "times.txt"), (poses, "poses.txt")):
            lines = kept(file.read_text().splitlines())
            (folder / name).write_text("\n".join(lines) + "\n")
        for camera in ("image_0", "image_1"):
            (folder / camera).mkdir()
            for i, image in enumerate(kept(sorted((source / camera).iterdir()))):
                (folder / camera / f"{i:06}.png").symlink_to(image)
        return folder

    def follows_few_pairs(self, dataset, seed, error_m, output="--out", options=()):
        estimate, report = self.folder / "estimate.txt", self.folder / "eval.json"
        ran = self.expect(sovo("run", "--dataset", dataset, "--deterministic", "--seed", seed,
                               output, estimate, *options), OK)
        if "(100.0 %)" not in ran.stdout:
            return False
        self.expect(sovo("eval", "--gt", dataset / "poses.txt", "--times", dataset / "times.txt",
                         "--est", estimate, "--json", report), OK)
        return json.loads(report.read_text())["ate_se3_m"]["rmse"] < error_m

    def test_a_turn_in_which_points_are_gone_before_their_scale_is_measured(self):
        # 0.7 m without static residuals.
        self.assertTrue(self.follows_few_pairs(self.thinned_kitti("00", 0, 4), 1, 0.2))

    def test_leaves_in_the_sun_of_which_few_pixels_agree(self):
        # Three frames were lost, and the way 0.34 m off.
        self.assertTrue(self.follows_few_pairs(self.thinned_kitti("00", 2, 4), 1, 0.2, "--out-live"))

    def test_a_map_begins_at_six_metres_a_frame(self):
        # Hardly anything is in view for long: one seed in six loses a frame.
        dataset = self.thinned_kitti("06", 2, 5)
        followed = [self.follows_few_pairs(dataset, seed, 0.3) for seed in (1, 2, 3)]
        self.assertGreaterEqual(followed.count(True), 2)

    def test_a_second_of_a_turn_is_missing(self):
        # By what was seen last it is known where that led, 4 m and 36 degrees on; else 3.8 m off.
        dataset = self.part_of_kitti("00", "gap", lambda i: 25 <= i < 40 or 50 <= i < 75)
        self.assertTrue(self.follows_few_pairs(dataset, 1, 0.2, "--out-live"))
        # Of 500 corners too few were found again: two frames were lost, and the way 1 m off.
        dataset = self.part_of_kitti("00", "gap_2", lambda i: 25 <= i < 50 or 60 <= i < 80)
        self.assertTrue(self.follows_few_pairs(dataset, 1, 0.3, "--out-live", ["--reverse"]))

    def test_while_a_second_is_missing_a_wrong_place_may_fit(self):
        # Half of the pixels agreed 0.6 m from where the camera was, and two thirds when turned by
        # 42 degrees; from there the way went on, 0.3 and 0.9 m off, as if nothing had been. Forward
        # it takes chance for that to fit.
        for first, last, options, seeds in ((70, 90, [], range(6)),
                                            (70, 100, ["--reverse"], [0])):
            dataset = self.part_of_euroc(f"gap_{first}_{last}",
                                         lambda i, gap=range(first, last): i not in gap)
            said = ""
            for seed in seeds:
                ran, live = self.follow(dataset, "--seed", str(seed), *options)
                said += ran.stderr
                self.assertLess(self.error_on_euroc(live), 0.02)
            self.assertIn("found by what the last keyframes saw", said)

    def follow(self, dataset, *options):
        live = self.folder / "live.txt"
        ran = self.expect(sovo("run", "--dataset", dataset, "--deterministic", "--out-live", live,
                               *options), OK)
        self.assertIn("(100.0 %)", ran.stdout)
        return ran, live

    def error_on_euroc(self, estimate):
        clip, report = SHARED / "data/euroc/MH_01_head/mav0", self.folder / "eval.json"
        self.expect(sovo("eval", "--gt", clip / "state_groundtruth_estimate0/data.csv",
                         "--gt-calib", clip / "cam0/sensor.yaml", "--est", estimate,
                         "--json", report), OK)
        return json.loads(report.read_text())["ate_se3_m"]["rmse"]

    def test_by_features(self):
        self.complete("euroc/MH_01_head", "--frames", 40, "--backend", "features")
        self.complete("kitti/sequences/06", "--frames", 20, "--backend", "features",
                      "--reverse")


if __name__ == "__main__":
    harness.main()
