"""What a direct method dislikes, flown through rendered worlds: `sovo run --world`."""

import math
import os

import harness
from flights import knocked, nothing_but_turning, rest_motion_rest, rest_then_hovering
from flights import restless, turn_on_the_spot, write_trajectory
from harness import FAILED, OK, largest_error, largest_step_error, read_tum, sovo
from sim_test import SimTest

LONG = bool(os.environ.get("SOVO_TEST_LONG"))


class Flight(SimTest):
    def trajectory(self, pose, seconds):
        path = self.folder / "trajectory.txt"
        write_trajectory(path, pose, seconds)
        return ("--trajectory", path, "--set", "sim.trajectory_body=base")

    def fly(self, world, *options, code=OK, calibration=None, **sensor):
        if calibration is None:
            calibration = ("--calib", self.calibration)
        truth, live, scales = (self.folder / n for n in ("truth.txt", "live.txt", "scales.csv"))
        settings = [part for key, value in sensor.items()
                    for part in ("--set", f"sim.sensor.{key}={value}")]
        result = sovo("run", "--deterministic", "--world", world, *calibration, "--truth", truth,
                      "--out-live", live, "--keyframes", scales, *options, *settings)
        self.expect(result, code)
        if code != OK:
            return result
        self.log = result.stderr
        self.verdicts = [line.strip().split(",") for line in scales.read_text().splitlines()[1:]]
        return read_tum(truth), read_tum(live)

    def expect_whole(self, truth, live, error_m):
        self.assertEqual(len(live), len(truth))
        self.assertNotIn("LOST", self.log)
        self.assertLess(largest_error(live, truth, live[0][0]), error_m)


class Robustness(Flight):
    def test_grass_turned_through_at_seven_degrees_a_frame(self):
        part = () if LONG else ("--start", 60, "--frames", 80)
        for direction in ((), ("--reverse",)):
            truth, live = self.fly("lawn", *part, *direction, "--set", "sim.frame_rate=12.5")
            self.assertEqual(len(live), len(truth))
            path = sum(math.dist(a[1], b[1]) for a, b in zip(truth, truth[1:]))
            origin = live[-1 if direction else 0][0]
            self.assertLess(largest_error(live, truth, origin), 0.005 * path)

    def test_the_map_begins_in_the_middle_of_an_open_highway(self):
        # Nearly three metres a frame, of which hardly anything near by tells.
        dark = {"vignette": 0.4, "calibrated": "false"}
        for world, start, sensor in ((1, 40, {}), (1, 140, {}), (3, 40, {}), (3, 20, dark),
                                     (7, 260, dark)):
            truth, live = self.fly("highway", "--reverse", "--start", start, "--frames", 12,
                                   "--seed", 1, "--set", f"sim.seed={world}", calibration=(),
                                   **sensor)
            self.expect_whole(truth, live, 0.5)

    def test_what_is_near_on_an_open_highway_stays_in_the_map(self):
        # It is out of view within a few frames: without a keyframe each the map is left with what
        # is far, which does not tell how far one went.
        truth, live = self.fly("highway", "--start", 140, "--frames", 40, "--seed", 1,
                               calibration=())
        self.expect_whole(truth, live, 1.2)
        self.assertLess(largest_step_error(live, truth), 0.2)

    def test_cameras_that_are_not_triggered_together(self):
        # Half a period apart: taken as of one instant it is more than a metre off.
        for part in (("--trajectory", "race", "--frames", 100), ("--frames", 120, "--reverse")):
            truth, live = self.fly("hall", *part, right_offset_ms=25)
            self.expect_whole(truth, live, 0.1)

    def test_the_right_camera_is_turned_against_its_calibration(self):
        # 1.3 px of yaw and 0.9 of pitch; taken as depth they lengthen the way by a tenth.
        images, fitting, out = (self.folder / n for n in ("images", "fitting.yaml", "out.txt"))
        self.expect(sovo("camera", "sim", "--world", "hall", "--trajectory", "loops", "--frames",
                         120, "--calib", self.calibration, "--export", images, "--set",
                         "sim.sensor.right_yaw_deg=0.4", "--set",
                         "sim.sensor.right_pitch_deg=-0.3"), OK)
        truth = read_tum(images / "groundtruth_cam0_tum.txt")
        said = "the right camera is turned against its calibration"

        def errors(*options):
            """Of all poses, and of the later half as seen from its first one."""
            result = self.expect(sovo("run", "--deterministic", "--dataset", images, "--out-live",
                                      out, *options), OK)
            poses = read_tum(out)
            later = poses[60:]
            return (result.stderr.count(said), largest_error(poses, truth, poses[0][0]),
                    largest_error(later, truth, later[0][0]))

        told, _, later = errors("--out-calib", fitting)
        self.assertEqual(told, 2)  # when it is found, and in the end
        self.assertLess(later, 0.02)
        told, all_of_it, _ = errors("--calib", fitting)
        self.assertEqual(told, 0)
        self.assertLess(all_of_it, 0.02)
        told, _, later = errors("--set", "right_turn.undo=false")
        self.assertEqual(told, 0)
        self.assertGreater(later, 0.1)

    def test_a_right_camera_that_is_turned_by_a_third_of_a_pixel(self):
        # Which makes ways 1 to 3 % too long.
        def later_half(*options):
            truth, live = self.fly("lawn", "--frames", 120, *options, calibration=(),
                                   right_yaw_deg=0.045)
            self.assertEqual(len(live), len(truth))
            return largest_error(live[60:], truth, live[60][0])

        self.assertLess(later_half(), 0.01)
        self.assertGreater(later_half("--set", "right_turn.undo=false"), 0.02)

    def test_rows_are_exposed_one_after_the_other(self):
        # Taken as of one instant 40 to 70 mm off; the race is knocked after two seconds.
        rolling = ("--set", "readout_ms=16")
        for part in (("--trajectory", "race", "--frames", 90), ("--frames", 100, "--reverse")):
            truth, live = self.fly("hall", *part, *rolling, readout_ms=16)
            self.expect_whole(truth, live, 0.03)

    def test_features_follow_blows_and_gaps(self):
        blows = self.trajectory(knocked, 6)
        self.expect_whole(*self.fly("hall", *blows, "--backend", "features"), 0.05)
        gaps = {"gap_s": 0.5, "gap_every_s": 1.5}
        truth, live = self.fly("hall", "--frames", 100, "--backend", "features", **gaps)
        self.expect_whole(truth, live, 0.06)

    def test_blur_of_restless_motion_that_ends_in_a_halt(self):
        flight = self.trajectory(lambda t: restless(t, 4.0), 7.0)
        truth, live = self.fly("hall", *flight, auto_exposure="false", exposure_ms=20)
        self.expect_whole(truth, live, 0.045)  # 0.049 with vo.motion_blur.enable: false
        still = [p for p in live if float(p[0]) > 1.6e9 + 5]
        self.assertLess(largest_error(still, truth, still[0][0]), 0.005)

    def test_blur_of_images_that_do_not_tell_how_long_they_were_exposed(self):
        flight = self.trajectory(lambda t: restless(t, 4.0), 7.0)
        recorded = self.folder / "recorded"
        self.expect(sovo("camera", "sim", "--world", "hall", "--calib", self.calibration, *flight,
                         "--set", "sim.sensor.auto_exposure=false", "--set",
                         "sim.sensor.exposure_ms=20", "--export", recorded), OK)
        for times in recorded.glob("dso/*/times.txt"):
            times.unlink()
        truth, live = recorded / "groundtruth_cam0_tum.txt", self.folder / "live.txt"
        seeds = range(1, 6)
        errors = {"true": [], "false": []}
        for enable, of_seeds in errors.items():
            for seed in seeds:
                result = self.expect(sovo("run", "--deterministic", "--dataset", recorded, "--seed",
                                          str(seed), "--out-live", live, "--set",
                                          f"vo.motion_blur.enable={enable}"), OK)
                self.assertNotIn("LOST", result.stderr)
                poses = read_tum(live)
                of_seeds.append(largest_error(poses, read_tum(truth), poses[0][0]))
        self.assertLess(max(errors["true"]), 0.045)
        self.assertLess(sum(errors["true"]), 0.85 * sum(errors["false"]))

    def test_turning_on_the_spot(self):
        flight = self.trajectory(turn_on_the_spot, 8.0)
        self.expect_whole(*self.fly("hall", *flight), 0.03)

    def test_nothing_but_turning(self):
        flight = self.trajectory(nothing_but_turning, 4.0)
        self.expect_whole(*self.fly("hall", *flight), 0.02)

    def test_blows_turn_it_by_many_degrees_from_one_frame_to_the_next(self):
        flight = self.trajectory(knocked, 9.0)
        for direction in ((), ("--reverse",)):
            self.expect_whole(*self.fly("hall", *flight, *direction), 0.03)

    def test_half_a_second_without_pairs_every_three(self):
        # In the first one the camera has begun to turn when the images come back.
        for part, pairs in ((("--start", 820, "--frames", 85), 75),
                            (("--frames", 130, "--reverse"), 110)):
            truth, live = self.fly("hall", *part, gap_s=0.5, gap_every_s=3)
            self.assertEqual(len(truth), pairs)
            self.expect_whole(truth, live, 0.05)

    def test_a_map_begins_at_six_metres_a_frame(self):
        # Up to a third of the mean depth; the motion is not known yet.
        for rate, direction in ((3.3, ()), (4, ("--reverse",))):
            truth, live = self.fly("street", "--trajectory", "expressway", "--frames", 12,
                                   *direction, "--set", f"sim.frame_rate={rate}", calibration=())
            self.expect_whole(truth, live, 0.5)

    def test_an_open_highway_shows_little_that_tells_how_far_one_went(self):
        # Lines, barriers and clouds look alike wherever one is on them; the asphalt is gone in a
        # frame or two.
        for part in (("--frames", 90), ("--trajectory", "slip", "--reverse", "--frames", 90)):
            truth, live = self.fly("highway", *part, "--set", "sim.traffic=busy", calibration=())
            self.expect_whole(truth, live, 4.0)
            # At 2.9 m a frame one that fits by chance is easily a metre off.
            self.assertLess(largest_step_error(live, truth), 0.33)

    def test_rest_then_motion_then_rest(self):
        seconds = 63.0 if LONG else 8.0
        flight = self.trajectory(rest_motion_rest, seconds)
        truth, live = self.fly("hall", *flight)
        self.expect_whole(truth, live, 0.01)
        still = [p for p in live if float(p[0]) > 1.6e9 + 3.5]
        self.assertLess(largest_error(still, truth, still[0][0]), 0.005)
        # The scale that stereo depth gave at rest is kept until motion shows it.
        corrections = [abs(float(v[1])) for v in self.verdicts]
        self.assertLess(max(corrections), 0.02)
        self.assertEqual({v[3] for v in self.verdicts} - {"accepted", "unobservable"}, set())


class RobustnessBesideBodies(Flight):
    """What moves with the cameras: the vehicle, its shadow, what it follows, dark corners."""

    def test_the_vehicles_own_shadow_on_bare_sand(self):
        # From rest on: what is strong moves with the cameras, and the sand hardly differs.
        for world in (1, 3):
            truth, live = self.fly("sand", "--frames", 60, "--set", "sim.own_shadow=true", "--set",
                                   f"sim.seed={world}", calibration=())
            self.expect_whole(truth, live, 0.02)

    def test_the_vehicles_own_body_before_bare_sand(self):
        # From rest on: what is strong moves with the cameras, and hides what it passes.
        for body, world in (("arms", 1), ("bonnet", 2)):
            truth, live = self.fly("sand", "--frames", 60, "--set", f"sim.own_body={body}", "--set",
                                   f"sim.seed={world}", calibration=())
            self.expect_whole(truth, live, 0.03)

    def test_the_vehicles_own_body_before_sand_that_is_passed_already_at_the_start(self):
        # Standing still fits nearly all of the image, and most of its texture.
        for body, world, start, haze in (("bonnet", 21, 70, 0), ("arms", 23, 200, 0.4),
                                         ("bonnet", 22, 200, 0.4)):
            truth, live = self.fly("sand", "--start", start, "--frames", 60, "--set",
                                   f"sim.own_body={body}", "--set", f"sim.seed={world}",
                                   veil=haze)
            self.expect_whole(truth, live, 0.05)
        # The true motion fits, with the body as so many outliers, or nothing does.
        for body in ("bonnet", "arms"):
            truth, live = self.fly("sand", "--start", 30, "--frames", 40, "--set",
                                   f"sim.own_body={body}", "--set", "sim.seed=13", calibration=())
            self.expect_whole(truth, live, 0.05)

    def test_the_vehicles_arms_before_a_hazy_pool_that_is_passed_already_at_the_start(self):
        # The tiles differ by a few grey levels, the arms that hold the lamps by dozens. Where the
        # lamps are found a new segment begins, in motion as well.
        for world, start in ((3, 50), (3, 200), (11, 200)):
            truth, live = self.fly("pool", "--start", start, "--frames", 50, "--set",
                                   "sim.own_body=arms", "--set", "sim.lamps.count=2", "--set",
                                   f"sim.seed={world}", calibration=(), veil=0.44)
            self.assertGreaterEqual(len(live), 45)
            self.assertLess(largest_error(live, truth, live[0][0]), 0.1)

    def test_darkened_corners_over_bare_sand(self):
        # They stay, and are stronger than anything in the sand.
        dark = {"vignette": 0.4, "calibrated": "false"}
        for world, direction in ((1, ()), (7, ("--reverse",))):
            options = ("--frames", 120, *direction, "--set", f"sim.seed={world}")
            truth, live = self.fly("sand", *options, calibration=(), **dark)
            self.expect_whole(truth, live, 0.03)

    def test_arms_alone_in_haze_do_not_make_a_vehicle_stand_unnoticed(self):
        # A race through a dark hall: what the lamps show best are the arms that hold them.
        for seed in (1, 2):
            truth, live = self.fly("hall", "--trajectory", "race", "--start", 50, "--frames", 40,
                                   "--seed", seed, "--set", "sim.seed=24", "--set",
                                   "sim.own_body=arms", "--set", "sim.lamps.count=2", "--set",
                                   "lighting=vehicle", calibration=(), veil=0.44)
            if largest_error(live, truth, live[0][0]) > 0.15:
                self.assertIn("DEGRADED: the camera seems to stand", self.log)

    def test_arms_in_thicker_haze_are_told_at_once(self):
        # What is left of the world drowns in the noise of whole images, and shows in smaller ones.
        for world, start in ((11, 50), (21, 200)):
            truth, live = self.fly("hall", "--trajectory", "race", "--start", start, "--frames", 20,
                                   "--set", f"sim.seed={world}", "--set", "sim.own_body=arms",
                                   "--set", "sim.lamps.count=2", calibration=(), veil=0.6)
            if largest_error(live, truth, live[0][0]) > 0.15:
                self.assertIn(f"frame {start + 1}: DEGRADED: the camera seems to stand", self.log)
                self.assertNotIn("TRACKING", self.log)

    def test_arms_and_a_world_in_haze_are_not_taken_for_one(self):
        # A way between that of the arms, none, and the true one fits most pixels. The lens darkens
        # the corners, of which the calibration knows nothing.
        for seed in (1, 2):
            truth, live = self.fly("pool", "--frames", 60, "--seed", seed, "--set", "sim.seed=46",
                                   "--set", "sim.own_body=arms", calibration=(), veil=0.5,
                                   response_gamma=1.8, vignette=0.4, calibrated="false")
            self.assertGreaterEqual(len(live), 50)
            self.assertLess(largest_error(live, truth, live[0][0]), 0.1)

    def test_a_lorry_that_stays_in_the_image_does_not_make_a_right_motion_doubtful(self):
        truth, live = self.fly("street", "--trajectory", "expressway", "--reverse", "--frames", 20,
                               "--set", "sim.seed=30", "--set", "sim.traffic=lorry",
                               calibration=(), read_noise=3, shot_noise=4)
        self.expect_whole(truth, live, 0.4)
        self.assertNotIn("seems to move", self.log)

    def test_a_lorry_close_ahead_hides_the_road(self):
        # Few points are left, and they leave the view soon; where the lorry turns it covers more.
        flights = ((("town", "--reverse", "--start", 100, "--frames", 45), 0.08),
                   (("expressway", "--frames", 95), 0.3))
        for (name, *part), error_m in flights:
            truth, live = self.fly("street", "--trajectory", name, *part,
                                   "--set", "sim.traffic=lorry", calibration=())
            self.expect_whole(truth, live, error_m)


class RobustnessOfLight(Flight):
    """Light that changes or moves, and water that hides the world."""

    def test_sunlight_that_moves_over_the_floor(self):
        # It bends the depths of a map: that is no turn of the right camera, and no scale.
        sun = ("--set", "sim.seed=2", "--set", "sim.caustics=2")
        truth, live = self.fly("pool", "--frames", 80, *sun)
        self.expect_whole(truth, live, 0.05)
        self.assertNotIn("turned", self.log)

    def test_the_waters_surface_does_not_drag_a_vehicle_at_rest_along(self):
        # It drifts as a whole, and without caustics it is the strongest texture in view. In the
        # second world a pose would leap to it, and the third is where rest is hardest to tell.
        for world in (1, 8, 11):
            truth, live = self.fly("pool", "--set", "sim.caustics=0", "--set",
                                   f"sim.seed={world}", *self.trajectory(rest_then_hovering, 8))
            self.expect_whole(truth, live, 0.03)

    def test_the_light_changes_at_once(self):
        truth, live = self.fly("hall", "--frames", 110, light_factor=0.35, light_from_s=1.5,
                               light_until_s=3)
        # When the light comes back the first image is white.
        self.assertGreaterEqual(len(live), len(truth) - 2)
        self.assertNotIn("segment", self.log)
        self.assertLess(largest_error(live, truth, live[0][0]), 0.03)

    def test_turbid_water_leaves_a_fifth_of_the_contrast(self):
        self.expect_whole(*self.fly("pool", "--frames", 80, veil=0.8), 0.05)

    def test_turbid_water_leaves_a_fifteenth_of_the_contrast(self):
        self.expect_whole(*self.fly("pool", "--frames", 80, veil=0.935), 0.05)

    def test_a_twelfth_of_the_light_without_exposure_control(self):
        dim = {"light_from_s": 0, "auto_exposure": "false", "exposure_ms": 8}
        self.expect_whole(*self.fly("hall", "--frames", 80, light_factor=0.08, **dim), 0.1)
        result = self.fly("hall", "--frames", 20, code=FAILED, light_factor=0.015, **dim)
        self.assertIn("no frame was tracked", result.stderr)

    def test_what_whole_images_do_not_show_smaller_ones_do(self):
        dim = {"light_from_s": 0, "auto_exposure": "false", "exposure_ms": 8}
        # Noise is seen through at once; haze is waited for, up to five frames.
        for world, sensor, error_m, waits in (("hall", {"light_factor": 0.04, **dim}, 0.1, 0),
                                              ("pool", {"veil": 0.97}, 0.06, 5)):
            truth, live = self.fly(world, "--frames", 85, calibration=(), **sensor)
            self.assertIn("images are reduced to 1/2 of their size", self.log)
            self.assertEqual(len(live), len(truth) - waits)
            self.assertLess(largest_error(live, truth, live[0][0]), error_m)

    def test_lamps_of_the_vehicle_are_found_out(self):
        # Without that 51 mm off, 3 with it; what is said of it comes with a new segment.
        truth, live = self.fly("pool", "--frames", 120, "--reverse", "--set",
                               "sim.lamps.count=2", calibration=())
        self.assertIn("lamps that move along light the scene; a new segment begins", self.log)
        self.assertEqual(len(live), len(truth))
        self.assertLess(largest_error(live, truth, live[0][0]), 0.03)

    def test_lamps_are_found_out_where_one_dives_into_the_dark(self):
        dive = ("--set", "sim.lamps.count=2", "--set", "sim.lamps.ambient_from_s=3", "--set",
                "sim.lamps.fade_s=2")
        truth, live = self.fly("pool", "--frames", 120, *dive, calibration=())
        self.assertIn("lamps that move along light the scene; a new segment begins", self.log)
        self.expect_whole(truth, live, 0.03)

    def test_lamps_of_the_vehicle_light_the_dark(self):
        # With lighting: world 0.09 m off, and lost.
        for light in (("--reverse",), ("--set", "sim.lamps.beam_deg=45")):
            self.expect_whole(*self.fly("pool", "--frames", 80, "--set", "sim.lamps.count=2", "--set",
                                        "lighting=vehicle", *light), 0.02)

    def test_nothing_is_claimed_where_nothing_can_be_seen(self):
        result = self.fly("pool", "--frames", 40, code=FAILED, veil=0.99)
        self.assertIn("no frame was tracked", result.stderr)
        self.assertIn("INITIALIZING: beginning from two views: too little texture", result.stderr)


if __name__ == "__main__":
    harness.main()
