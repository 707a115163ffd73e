#!/usr/bin/env python3
"""speed.py without its stopwatch: what its table says, reads back, and calls slower."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import speed


def row(job="a job", kind="points", ratio=100.0, **more):
    return speed.Row(job, kind, ratio, **more)


class Rows(unittest.TestCase):
    def test_hold_on_the_right_side_of_their_limit(self):
        self.assertTrue(row(ratio=36, asked=36).holds())
        self.assertFalse(row(ratio=37, asked=36).holds())
        self.assertTrue(row(kind="share", ratio=0.6, asked=0.5).holds())
        self.assertFalse(row(kind="share", ratio=0.4, asked=0.5).holds())
        self.assertIsNone(row().holds())

    def test_limits_in_seconds_are_points_of_the_reference(self):
        self.assertAlmostEqual(speed.points(0.5), 51)

    def test_show_all_that_was_measured(self):
        shown = speed.cells(row("draw", "peer", 1.062, asked=1.15, wall=1.5, processor=0.25, yardstick=101.7, peer="y4m"))
        self.assertEqual(shown, ["draw", "1.50 s", "250 ms", "102", "1.06 times y4m", "≤ 1.15", "yes"])
        self.assertEqual(len(shown), len(speed.HEADER))
        self.assertEqual(speed.cells(row("m", "memory", 812.4, asked=750))[4:], ["812 MB", "≤ 750", "no"])


class Comparison(unittest.TestCase):
    def test_names_what_became_slower_by_more_than_a_tenth(self):
        old = [row("a"), row("b"), row("c", "share", 0.5), row("d", "share", 0.5), row("gone")]
        new = [row("a", ratio=109), row("b", ratio=112), row("c", "share", 0.46), row("d", "share", 0.4), row("new")]
        lines, gone = speed.slower(old, new)
        self.assertEqual(lines, ["b: 100 → 112 million points, 12 % slower",
                                 "d: 0.50 → 0.40 of the yardstick, 25 % slower"])
        self.assertEqual(gone, ["gone"])

    def test_goes_by_ratios_not_by_seconds(self):
        fast, slow = row(wall=1.0, yardstick=100), row(wall=2.0, yardstick=50)
        self.assertEqual(speed.slower([fast], [slow]), ([], []))


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name) / "table.json"

    def write(self, value):
        self.path.write_text(json.dumps(value))

    def test_come_back_as_they_were_written(self):
        rows = [row("x", "peer", 1.2, asked=1.15, wall=2.0, processor=3.0, yardstick=90.0, peer="y4m"), row("y", "memory", 10)]
        self.write({"version": speed.VERSION, "rows": [r.to_json() for r in rows]})
        self.assertEqual([vars(r) for r in speed.read_table(self.path)], [vars(r) for r in rows])

    def test_of_another_kind_are_refused_with_their_name(self):
        for value in ([], {"version": 99, "rows": []}, {"version": 1}, {"version": 1, "rows": [{"job": "x", "kind": "hue"}]},
                      {"version": 1, "rows": [{"job": "x", "kind": "peer", "ratio": 0}]}, {"version": 1, "rows": [3]}):
            self.write(value)
            with self.assertRaisesRegex(ValueError, "table.json' is not a table"):
                speed.read_table(self.path)

    def test_that_do_not_read_end_the_program_before_it_measures(self):
        program = pathlib.Path(__file__).with_name("speed.py")
        done = subprocess.run([sys.executable, program, "nowhere", "--against", self.path], capture_output=True,
                              text=True, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("is not a table of speed.py --json", done.stderr)


if __name__ == "__main__":
    unittest.main()
