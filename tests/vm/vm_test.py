#!/usr/bin/env python3
"""Real camera drivers of the kernel in a virtual machine, and what camera_check sees of them.

Usage: vm_test.py --bin DIRECTORY --work DIRECTORY [--prepare]

What it needs is in machine.py; --prepare does no more than fetch that, where there is a network.
"""

import json
import re
import sys
import unittest

import machine
from machine import LONG, cases_of


class Cameras(unittest.TestCase):
    """One boot for all of them."""

    machine = None

    @classmethod
    def setUpClass(cls):
        for again in (True, False):
            cls.output = cls.machine.boot("guest_cameras.sh", 3000 if LONG else 800)
            cls.cases = cases_of(cls.output)
            # A kernel that panics once is no fault of the cameras' code.
            if "GUEST ENDED with 0" in cls.output or not again:
                break
            print("booting once more: the machine did not end as it should")

    def lines(self, case):
        self.assertIn(case, self.cases, self.output[-3000:])
        return self.cases[case]

    def result(self, case):
        for line in self.lines(case):
            if line.startswith("RESULT "):
                return json.loads(line[7:])
        return self.fail(f"{case} has no result:\n" + self.output[-3000:])

    def expect_whole(self, result):
        """Nothing torn or mixed, and every image that is missing is counted. How many are missing
        cannot be asked: an emulated machine on a busy host stands still for longer than a driver
        waits for its reader, and looks at fewer images than come."""
        for fault in ("torn", "mixed", "not_rising"):
            self.assertEqual(result[fault], 0, result)
        dropped = result["skipped"] + result["damaged"] + result["short"] + result["no_room"]
        self.assertLessEqual(result["missing"], dropped + result["queue_dropped"], result)

    def test_zed_lists_its_modes_and_controls(self):
        text = "\n".join(self.lines("zed_list"))
        for part in ("2b03:f582", "serial 0012345", "mode 4416x1242 YUYV at 15 Hz",
                     "mode 1344x376 YUYV at 100, 60, 30, 15 Hz", "control brightness=4 (0 to 8",
                     "control exposure_time_absolute="):
            self.assertIn(part, text)

    def test_zed_streams(self):
        result = self.result("zed_stream")
        self.expect_whole(result)
        self.assertEqual(result["uncounted"], 0, result)
        self.assertEqual(result["coloured"], 0, result)  # nobody asked
        self.assertGreaterEqual(result["frames"], 100)
        self.assertAlmostEqual(result["exposure_ms"], 4.2, 4)  # as the control was set

    def test_the_command_publishes(self):
        text = "\n".join(self.lines("zed_published"))
        self.assertIn("published 30 frames", text)
        # A slow host may skip images, but must not damage any.
        counts = re.search(r"camera: (\d+) images, \d+ skipped, 0 damaged, 0 short", text)
        self.assertIsNotNone(counts, text)
        self.assertGreaterEqual(int(counts[1]), 30, text)

    def test_zed_controls_hold_and_bad_ones_are_refused(self):
        for line in ("gain: 33", "exposure_time_absolute: 42", "auto_exposure: 1 (Manual Mode)"):
            self.assertIn(line, self.lines("zed_stream"))
        text = "\n".join(self.lines("zed_controls"))
        self.assertIn("must be 0 to 100", text)
        self.assertIn("did you mean 'brightness'?", text)

    def test_zed_comes_back_after_every_unplugging(self):
        result = self.result("zed_unplug")
        self.expect_whole(result)
        self.assertEqual(result["uncounted"], 0, result)
        repeats = 10 if LONG else 2
        self.assertEqual(result["disconnects"], repeats, result)
        self.assertEqual(result["reconnects"], repeats, result)
        self.assertIn("gain: 44", self.lines("zed_unplug"))  # set again after the last return
        times = {word: [float(line.split()[2]) for line in self.lines("zed_unplug")
                        if line.startswith(word + " ")] for word in ("NODE", "BACK")}
        waits = [back - node for node, back in zip(times["NODE"], times["BACK"])]
        self.assertEqual(len(waits), repeats)
        print(f"seconds from the device's return to its first image: {waits}")
        if LONG:
            self.assertLess(max(waits), 2.0)

    def expect_pairs(self, result):
        """Pairs are of one instant, and each image that came is in one or counted as alone. `late`
        are pairs of which the emulated bus, not the camera, brought an image in another's time."""
        for fault in ("torn", "mixed", "not_rising"):
            self.assertEqual(result[fault], 0, result)
        self.assertLessEqual(result["largest_error_ms"], 25.0, result)
        waiting = 12  # images that still wait for the other side, the caller or these counts
        frames = result["frames"] + result["queue_dropped"]
        for all_of_them, counted in (
                (result["left"]["images"], result["pairs"] + result["unpaired_left"]),
                (result["right"]["images"], result["pairs"] + result["unpaired_right"]),
                (result["pairs"] + result["unpaired_left"], frames)):
            self.assertGreaterEqual(all_of_them, counted, result)
            self.assertLessEqual(all_of_them, counted + waiting + result["out_of_order"], result)

    def test_two_cameras_are_paired_by_instant(self):
        result = self.result("two_cameras")
        self.expect_pairs(result)
        self.assertGreaterEqual(result["pairs"], 180 if LONG else 15, result)
        text = "\n".join(self.lines("two_cameras"))
        self.assertRegex(text, "'/dev/video[0-9]+' and '0000001' are the same device")

    def test_images_of_a_camera_whose_other_one_stands_still_are_counted_by_side(self):
        result = self.result("two_cameras_stalled")
        self.expect_pairs(result)
        self.assertGreaterEqual(result["alone"], 4, result)
        self.assertGreaterEqual(result["unpaired_right"], 4, result)
        self.assertIn("PAIRS AT THE END 10", self.lines("two_cameras_stalled"))
        for side in ("left", "right"):
            self.assertEqual(result[side]["disconnects"], 0, result)

    def test_one_of_two_cameras_comes_back_while_the_other_goes_on(self):
        result = self.result("two_cameras_unplugged")
        self.expect_pairs(result)
        self.assertGreaterEqual(result["alone"], 1, result)
        self.assertIn("PAIRS AT THE END 10", self.lines("two_cameras_unplugged"))
        self.assertEqual(result["right"]["disconnects"], 1, result)
        self.assertEqual(result["right"]["reconnects"], 1, result)
        self.assertEqual(result["left"]["disconnects"], 0, result)

    def test_cameras_that_expose_half_a_period_apart_are_not_paired(self):
        result = self.result("two_cameras_half_a_period_apart")
        self.expect_pairs(result)
        self.assertGreaterEqual(result["alone"], 10, result)
        self.assertGreaterEqual(result["unpaired_right"], 10, result)
        self.assertEqual(result["pairs"], result["late"], result)

    def test_loopback_content(self):
        result = self.result("loopback")
        self.expect_whole(result)
        # VIDIOC_REQBUFS of v4l2loopback resets the number of the image that is already there, so
        # that the first step may have another length than the images'.
        self.assertLessEqual(result["uncounted"], 1, result)
        self.assertGreater(result["frames"], 20)
        self.assertGreater(result["coloured"], 0, result)
        self.assertEqual(result["miscoloured"], 0, result)

    def test_vivid_faults_are_survived_and_counted(self):
        result = self.result("vivid_errors")
        self.assertGreater(result["damaged"], 0, result)
        self.assertGreater(result["skipped"], 0, result)
        gone = self.result("vivid_disconnect")
        self.assertGreaterEqual(gone["disconnects"], 1, gone)
        self.assertGreaterEqual(gone["reconnects"], 1, gone)


if __name__ == "__main__":
    sys.exit(machine.main(Cameras))
