"""`sovo report`: the page tells what the odometry published, and nothing on it is markup of others."""

import html.parser
import json
import math
import re
import signal
import time

import harness
from bus_test import FRAMES, TRUTH
from harness import BAD_INPUT, OK, USAGE, read_tum, sovo
from record_test import RecordTest


class Page(html.parser.HTMLParser):
    """Texts by id, rows of tables by id, and the names of all elements and attributes."""

    def __init__(self, text):
        super().__init__()
        self.texts, self.tables, self.tags, self.attributes = {}, {}, set(), set()
        self.open_id = self.table = self.cell = None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes.update(name for name, _ in attrs)
        name = dict(attrs).get("id")
        if tag == "table":
            self.table = self.tables.setdefault(name, [])
        elif tag == "tr":
            self.table.append([])
        elif tag in ("td", "th"):
            self.table[-1].append("")
            self.cell = True
        elif name:
            self.open_id = name
            self.texts[name] = ""

    def handle_endtag(self, tag):
        self.open_id = None
        if tag in ("td", "th"):
            self.cell = None

    def handle_data(self, data):
        if self.open_id:
            self.texts[self.open_id] += data
        elif self.cell:
            self.table[-1][-1] += data


class Reports(RecordTest):
    def record_run(self, *options):
        """Records camera and odometry; its trajectory and its log, as it wrote them itself."""
        live = self.folder / "live.txt"
        vo = self.start("vo", "--set", "wait_for_mapping=true", "--out-live", live)
        recorder = self.record(*options)
        self.expect(self.camera("--rate", "max"), OK)
        time.sleep(0.5)
        log = []
        for process in (vo, recorder):
            process.send_signal(signal.SIGINT)
            log.append(self.finish(process)[1])
        return live, log[0]

    def report(self, *options):
        out = self.folder / "report.html"
        done = self.expect(sovo("report", self.dive, "-o", out, *options), OK)
        self.assertEqual(done.stdout.strip(), str(out))
        text = out.read_text()
        for outside in ("<script", "<link", "<img", "<iframe", "http:", "https:", "url(", "@import"):
            self.assertNotIn(outside, text)
        return Page(text)

    def test_its_numbers_are_those_of_the_run(self):
        live, log = self.record_run()
        page = self.report("--gt", TRUTH, "--step", "1")
        positions = [p for _, p, _ in read_tum(live)]
        # The base and the camera of this rig are in one place.
        way = sum(math.dist(a, b) for a, b in zip(positions, positions[1:]))
        self.assertAlmostEqual(float(page.texts["distance"].split()[0]), way, delta=0.006)
        self.assertEqual(page.texts["frames"], f"{len(positions)} of {FRAMES}")
        told = re.search(r"lost in transport (\d+), dropped (\d+)", log)
        self.assertEqual((page.texts["lost_transport"], page.texts["dropped"]), told.groups())
        topics = {row[0]: row for row in page.tables["topics"]}
        self.assertEqual(topics[f"/{self.bus[-1]}/stereo"][2], str(FRAMES))
        self.assertIn("tracking", [row[0] for row in page.tables["stages"]])

        numbers = self.folder / "eval.json"
        self.expect(sovo("eval", "--gt", TRUTH, "--est", live, "--step", 1, "--json", numbers), OK)
        expected = json.loads(numbers.read_text())
        absolute = {row[0]: row[1:] for row in page.tables["absolute"]}
        for row, key in (("SE(3) [m]", "ate_se3_m"), ("Sim(3) [m]", "ate_sim3_m")):
            self.assertAlmostEqual(float(absolute[row][0]), expected[key]["rmse"], delta=6e-5)
        states = {row[0] for row in page.tables.get("periods", [])[1:]}
        self.assertNotIn("Lost", states)

    def test_images_can_be_left_out_of_the_recording(self):
        self.record_run("--topics=-stereo")
        page = self.report()
        topics = {row[0] for row in page.tables["topics"]}
        self.assertNotIn(f"/{self.bus[-1]}/stereo", topics)
        self.assertIn(f"/{self.bus[-1]}/status", topics)
        self.assertNotIn("absolute", page.tables)

    def test_a_cut_recording_is_told_and_read_up_to_there(self):
        self.record_run()
        whole = self.report()
        file = self.dive / "dive_0.mcap"
        data = file.read_bytes()
        file.write_bytes(data[:len(data) * 3 // 4])
        cut = self.report()
        self.assertIn("notes", cut.texts)
        self.assertLess(float(cut.texts["distance"].split()[0]),
                        float(whole.texts["distance"].split()[0]))


class ReportRefusals(harness.CommandTest):
    def test_what_cannot_be_is_said(self):
        text = self.folder / "text.mcap"
        text.write_text("no recording at all, but a text of some length\n")
        for command, code, words in [
                (["report"], USAGE, "recording"),
                (["report", self.folder / "nothing"], BAD_INPUT, "does not exist"),
                (["report", self.folder / "."], BAD_INPUT, "text.mcap"),
                (["report", text], BAD_INPUT, "text.mcap")]:
            with self.subTest(command=command):
                self.assertIn(words, self.expect(sovo(*command), code).stderr)


if __name__ == "__main__":
    harness.main()
