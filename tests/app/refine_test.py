"""A lens that a recording refines: `sovo calib refine`, and the notice that it is needed."""

import os
import re
import unittest

import harness
from harness import BAD_INPUT, FAILED, OK, SMALL_RIG, USAGE, CommandTest, sovo


def numbers(calibration, key):
    """Of the left and the right camera."""
    return [float(value) for value in re.findall(rf"\b{key}: ([-\d.e]+)", calibration)]


class CalibRefine(CommandTest):
    """Flights through the hall, seen by cameras whose focal lengths are taken to be 2 % longer."""

    WRONG = 1.02

    def setUp(self):
        super().setUp()
        self.out = self.folder / "refined.yaml"

    def record(self, trajectory, frames):
        dataset = self.folder / trajectory
        self.expect(sovo("camera", "sim", "--world", "hall", "--trajectory", trajectory,
                         "--calib", SMALL_RIG, "--frames", frames, "--export", dataset), OK)
        wrong = self.folder / "wrong.yaml"
        wrong.write_text(re.sub(r"\b(f[xy]): ([\d.]+)",
                                lambda m: f"{m[1]}: {float(m[2]) * self.WRONG}",
                                SMALL_RIG.read_text()))
        return "--dataset", dataset, "--calib", wrong

    @unittest.skipIf(os.environ.get("SOVO_SANITIZED") == "1", "takes minutes")
    def test_the_lenses_as_they_are(self):
        result = sovo("calib", "refine", *self.record("race", 100), "--out", self.out)
        self.expect(result, OK)
        self.assertRegex(result.stdout, r"(?m)^pass 1: focal length \+0\.00 %")
        self.assertRegex(result.stdout, r"(?m)^left: fx 178\.500 -> 17\d\.\d+ px \(-[12]\.\d+ %")
        self.assertRegex(result.stdout, r"(?m)^right: ")
        written = self.out.read_text()
        for fx, truth in zip(numbers(written, "fx"), (175.0, 176.0), strict=True):
            self.assertLess(abs(fx / truth - 1.0), 0.004)
        self.expect(sovo("calib", "show", self.out), OK)

    @unittest.skipIf(os.environ.get("SOVO_SANITIZED") == "1", "takes minutes")
    def test_a_run_tells_that_the_lens_is_another_one(self):
        source = self.record("race", 300)
        wrong = sovo("run", "--deterministic", *source)
        self.expect(wrong, OK)
        self.assertRegex(wrong.stderr, r"keyframes see it \d\.\d % shorter")
        self.assertIn("find it with sovo calib refine", wrong.stderr)
        right = sovo("run", "--deterministic", *source[:2], "--calib", SMALL_RIG)
        self.expect(right, OK)
        self.assertNotIn("focal length", right.stderr)

    def test_too_short_a_recording_tells_nothing(self):
        result = sovo("calib", "refine", *self.record("race", 12), "--out", self.out)
        self.expect(result, FAILED)
        self.assertIn("does not tell the lens; turn the cameras", result.stderr)
        self.assertFalse(self.out.exists())

    def test_refusals(self):
        self.assertIn("--dataset FOLDER or --mcap",
                      self.expect(sovo("calib", "refine", "--out", self.out), USAGE).stderr)
        self.expect(sovo("calib", "refine", "--dataset", self.folder / "none", "--out", self.out),
                    BAD_INPUT)
        self.expect(sovo("calib", "refine", "--dataset", self.folder), USAGE)  # without --out
        # Before minutes are spent.
        self.expect(sovo("calib", "refine", "--dataset", self.folder, "--out",
                         self.folder / "none" / "refined.yaml"), USAGE)
        by_features = self.folder / "features.yaml"
        by_features.write_text("backend: features\n")
        result = sovo("calib", "refine", "--dataset", self.folder, "--out", self.out, "--config",
                      by_features)
        self.assertIn("backend: direct", self.expect(result, USAGE).stderr)


if __name__ == "__main__":
    harness.main()
