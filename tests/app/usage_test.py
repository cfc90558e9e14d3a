"""How the command answers to what it is asked: help, configuration, wrong input."""

import re

import harness
from harness import BAD_INPUT, DATASET, OK, ROOT, USAGE, CommandTest, sovo

COMMANDS = [["run"], ["camera"], ["camera", "dataset"], ["vo"], ["status"], ["command"],
            ["command", "reset"], ["config"], ["eval"], ["calib"]]


class Help(CommandTest):
    def test_every_command_has_help_with_exit_codes(self):
        for command in [[]] + COMMANDS:
            with self.subTest(command=command):
                result = self.expect(sovo(*command, "--help"), OK)
                self.assertIn("Usage: ", result.stdout)
                self.assertIn("Exit codes: 0 ", result.stdout)

    def test_help_names_every_world(self):
        worlds = re.search(r"world: .*one of ([a-z|]+)", sovo("config").stdout).group(1)
        self.assertIn("highway", worlds)
        self.assertIn(f"--world {worlds}", self.expect(sovo("run", "--help"), OK).stdout)

    def test_version(self):
        self.assertRegex(self.expect(sovo("--version"), OK).stdout, r"^sovo \d+\.\d+\.\d+\n$")

    def test_no_command_and_unknown_command_are_wrong_usage(self):
        self.expect(sovo(), USAGE)
        self.expect(sovo("fly"), USAGE)
        self.expect(sovo("run", "--fly"), USAGE)


class Configuration(CommandTest):
    def file(self, text):
        path = self.folder / "sovo.yaml"
        path.write_text(text)
        return path

    def test_unknown_key_is_named_with_its_line(self):
        path = self.file("mode: scale\nscale:\n  methd: paper\n")
        result = self.expect(sovo("--config", path, "config"), USAGE)
        self.assertIn(f"{path}:3:", result.stderr)
        self.assertIn("methd", result.stderr)

    def test_wrong_values_are_refused(self):
        for assignment in ["mode=fast", "threads=many", "threads=0", "camera.rate=-1",
                           "camera.start=-1", "no.such.key=1", "mode",
                           "vo.keyframe.approach=-1", "vo.window.static_weight=nan",
                           "vo.selection.border=3", "vo.selection.least_offset=8",
                           "filter.drift_sigma=-0.1", "filter.drift_distance=0",
                           "assist.few_points=0.9", "assist.good_keyframes=0",
                           "vo.weak_texture.least_share=0", "vo.weak_texture.to_gradient=20",
                           "vo.co_moving.cell=3", "vo.co_moving.min_displacement=0",
                           "vo.co_moving.better_match=2", "vo.co_moving.stays_below=1",
                           "vo.co_moving.keyframes=0", "vo.motion_blur.least_share=1",
                           "vo.keyframe.max_keyframes=9", "vo.keyframe.max_keyframes=2",
                           "vo.keyframe.min_keyframes=0", "vo.points.active_points=0",
                           "vo.tracker.max_levels=0", "vo.window.max_iterations=0",
                           "vo.window.point_spread_px=-0.1", "vo.window.point_spread_px=nan",
                           "vo.window.huber=0", "vo.tracker.gradient_constant=0",
                           "vo.weak_texture.least_rms=-1", "vo.selection.min_spread=1",
                           "lighting=lamp", "local_contrast.radius=0", "local_contrast.floor=0",
                           "loops.place_step=0", "loops.keypoints.per_image=10",
                           "loops.max_places=1", "loops.matching.sigma_px=0",
                           "backend=feature", "features.features=10", "features.levels=0",
                           "features.max_keyframes=2", "features.free_keyframes=12",
                           "features.sigma_px=0", "features.weak_corner=20",
                           "features.outlier_sigmas=nan", "features.depth_damping=-1",
                           "features.max_iterations=0", "features.max_iterations_window=0"]:
            with self.subTest(assignment=assignment):
                self.expect(sovo("--set", assignment, "config"), USAGE)

    def test_features_have_no_mode_stereo_and_say_what_to_do(self):
        for options in (("--set", "mode=stereo"), ("--preset", "quality")):
            result = self.expect(sovo("config", "--set", "backend=features", *options), USAGE)
            self.assertIn("use mode: scale", result.stderr)
        self.expect(sovo("config", "--set", "backend=features", "--preset", "quality",
                         "--set", "mode=scale"), OK)

    def test_dump_reads_back_as_the_same(self):
        first = self.expect(sovo("config", "--set", "seed=7"), OK).stdout
        second = self.expect(sovo("config", "--config", self.file(first)), OK).stdout
        self.assertIn("seed: 7", first)
        self.assertEqual(first, second)

    def test_command_line_wins_over_file_over_preset(self):
        path = self.file("preset: embedded\nseed: 1\nvo:\n  points:\n    active_points: 900\n")
        dump = self.expect(sovo("--config", path, "--set", "seed=2", "config"), OK).stdout
        self.assertIn("seed: 2", dump)
        self.assertIn("active_points: 900", dump)
        self.assertIn("immature_points: 250", dump)

    def test_presets(self):
        default = self.expect(sovo("config"), OK).stdout.splitlines()
        changed = {}
        for name in ("embedded", "default", "quality"):
            dump = self.expect(sovo("config", "--preset", name), OK).stdout.splitlines()
            self.assertTrue(dump[0].startswith(f"preset: {name} "), dump[0])
            changed[name] = [new.split("#")[0].strip()
                             for old, new in zip(default[1:], dump[1:]) if old != new]
        self.assertEqual(changed["default"], [])
        self.assertIn("active_points: 800", changed["embedded"])
        self.assertEqual(changed["quality"],
                         ["mode: stereo", "immature_points: 700", "max_iterations: 10"])
        named = self.expect(sovo("config", "--preset", "quality", "--set", "mode=scale"), OK).stdout
        self.assertIn("\nmode: scale ", named)
        for refused in (sovo("config", "--preset", "fast"),
                        sovo("config", "--config", self.file("preset: fast\n"))):
            self.expect(refused, USAGE)
            self.assertIn("fast", refused.stderr)
            for name in changed:
                self.assertIn(name, refused.stderr)

    def test_shipped_example_is_the_default(self):
        dump = self.expect(sovo("config"), OK).stdout
        self.assertEqual((ROOT / "config" / "sovo.yaml").read_text(), dump,
                         "write it anew: sovo config > config/sovo.yaml")


class BadInput(CommandTest):
    def test_missing_dataset(self):
        for command in (["run", "--dataset"], ["camera", "dataset", "--path"]):
            with self.subTest(command=command):
                path = self.folder / "absent"
                result = self.expect(sovo(*command, path), BAD_INPUT)
                self.assertIn(str(path), result.stderr)

    def test_folder_that_is_no_dataset(self):
        self.expect(sovo("run", "--dataset", self.folder), BAD_INPUT)

    def test_dataset_must_be_named(self):
        self.expect(sovo("run"), USAGE)
        self.expect(sovo("camera", "dataset"), USAGE)

    def test_calibration_with_nan(self):
        path = self.folder / "calibration.yaml"
        path.write_text("left: {fx: .nan}\n")
        result = self.expect(sovo("run", "--dataset", DATASET, "--calib", path), BAD_INPUT)
        self.assertIn(str(path), result.stderr)

    def test_outputs_are_checked_before_the_run(self):
        out = self.folder / "absent" / "out.txt"
        result = self.expect(sovo("run", "--dataset", DATASET, "--out", out), USAGE)
        self.assertIn("absent", result.stderr)

    def test_more_frames_left_out_than_there_are(self):
        self.expect(sovo("run", "--dataset", DATASET, "--start", 1000), BAD_INPUT)


if __name__ == "__main__":
    harness.main()
