"""What the scripts answer before they install or build anything."""

import subprocess

import harness
from harness import ROOT, CommandTest


def script(name, *arguments):
    return subprocess.run([ROOT / "scripts" / name, *arguments], capture_output=True, text=True,
                          timeout=60)


def packages(*arguments):
    result = script("install-deps", *arguments, "--list")
    return set(result.stdout.split()) if result.returncode == 0 else set()


class Scripts(CommandTest):
    def test_each_set_of_packages_holds_the_smaller_ones(self):
        core, without_page, all_of_it, dev = (
            packages(*which) for which in (["--core"], ["--without-page"], [], ["--dev"]))
        self.assertTrue({"g++", "cmake", "ninja-build", "libeigen3-dev"} <= core)
        self.assertTrue(core < without_page < all_of_it < dev)
        self.assertEqual(all_of_it - without_page, {"nodejs", "npm"})
        self.assertIn("cyclonedds-tools", without_page - core)

    def test_help_and_wrong_arguments(self):
        for name in ["build", "build-page", "demo", "install-deps", "test"]:
            with self.subTest(script=name):
                result = script(name, "--help")
                self.assertEqual(result.returncode, 0)
                self.assertIn("Usage: ", result.stdout)
                self.assertIn("Exit codes: 0 ", result.stdout)
                result = script(name, "--fly")
                self.assertEqual(result.returncode, 2)
                self.assertIn("--help", result.stderr)

    def test_demo_of_what_is_not_there(self):
        result = script("demo", self.folder / "nothing")
        self.assertEqual(result.returncode, 3)
        self.assertIn("SOVO_SHARED", result.stderr)
        result = script("demo", "--rate", "max", self.folder)
        self.assertEqual(result.returncode, 2)
        self.assertIn("simulated worlds", result.stderr)
        self.assertEqual(script("demo", "--rate").returncode, 2)


if __name__ == "__main__":
    harness.main()
