"""Tables 21 to 23 and 27 to 31 of the thesis: volume rendering on machines of 1993.

Their seconds are those machines' own, so nothing is timed here. Compared is what does not depend on them: quotients that one
table prints of another's numbers; differences of seconds divided by the seconds of one operation or one send, which are counts; and
quotients of seconds beside the planner's for profiles of these machines. What of these tables the profiles were fitted to stands in
timings.csv: of the MP-1 nothing, of the MP-2 and the Proteus half. Needs EDGEWISE."""

import functools
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

HERE = pathlib.Path(os.environ.get("EDGEWISE_TESTS", pathlib.Path(__file__).parents[1])) / "thesis"
COMMAND = os.environ.get("EDGEWISE", "build/release/bin/edgewise")
# Each of two predicted seconds is within a quarter (machines_test.cpp: in the median), so their quotient is within 1.25^2.
QUARTER = 1.25
WAYS = {"foh": "warp.permutation/filter=foh", "zoh": "warp.backward/filter=zoh"}  # as the thesis rendered
TURNS = ("deg20_ms", "deg40_ms", "deg60_ms", "deg80_ms")
ALL_TURNS = [turn.format(degrees) for turn in ("{0},0,0", "0,{0},0", "0,0,{0}", "{0},{0},{0}") for degrees in (0, 20, 40, 60, 80)]


def table(number):
    """Rows of a table, as printed; numbers are f64."""
    lines = [line for line in (HERE / f"tables/table{number}.csv").read_text().splitlines() if not line.startswith("#")]
    names = lines[0].split(",")
    rows = [dict(zip(names, line.split(","))) for line in lines[1:]]
    return [{name: value if name in ("filter", "axes") else float(value) for name, value in row.items()} for row in rows]


def by_filter(number, **more):
    return {row["filter"]: row for row in table(number) if all(row[key] == value for key, value in more.items())}


class Tables(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(dir=os.environ.get("EDGEWISE_SCRATCH"))
        cls.addClassCleanup(folder.cleanup)
        cls.env = {**os.environ, "XDG_CONFIG_HOME": folder.name, "XDG_CACHE_HOME": folder.name}

    @functools.lru_cache(maxsize=None)
    def seconds(self, machine, side, turn, *words):
        """Predicted seconds of a maximum projection of a cube, pixels as large as samples."""
        done = subprocess.run([COMMAND, "plan", "render", f"describe:{side}x{side}x{side}:u8", "--rotate", turn, "--size", f"{side}x{side}",
                               "--spacing", "1", "--machine", machine, "--max-error", "9", *words, "--json", "-", "--quiet"],
                              capture_output=True, text=True, env=self.env, check=True)
        return json.loads(done.stdout)["plan"]["predicted"]["seconds"]

    def rendered(self, machine, layout, side, hold, turn):
        return self.seconds(machine, side, turn, "--via", f"net.spread/layout={layout}", "--via", WAYS[hold], "--via", "project.combine")

    @staticmethod
    def unit(machine, name):
        """Seconds of a unit of a machine's profile."""
        return json.loads((HERE.parents[1] / f"planner/machines/{machine}.json").read_text())[name]

    def assertWithin(self, value, expected, factor, what=""):
        self.assertTrue(expected / factor <= value <= expected * factor, f"{what}: {value:.4g} for {expected:.4g}, factor {factor}")

    def test_tables_21_and_22_are_of_one_measurement(self):
        # Percentages of Table 21 are of the smallest mean. tables21_22_test.cpp makes the means themselves.
        for body in ("cube", "sphere"):
            least = min(row[f"{body}_mean"] for row in table(21))
            for row in table(21):
                # Cut to whole percents, or rounded.
                self.assertAlmostEqual(row[f"{body}_percent_worse"], 100 * (row[f"{body}_mean"] / least - 1), delta=1)
        # At 45 degrees alone errors are those of the mean over 5 to 45, but for a few percent.
        for mean, one in zip(table(21), table(22)):
            for body in ("cube", "sphere"):
                self.assertWithin(mean[f"{body}_mean"], one[f"{body}_mean"], 1.04, mean["filter"])
                self.assertLess(one[f"{body}_mean"], one[f"{body}_max"])

    def test_table_27_takes_eight_times_as_long_for_twice_the_side(self):
        for hold in WAYS:
            rows = {row["size"]: row for row in table(27) if row["filter"] == hold}
            for side in (32, 64, 128):
                printed = rows[2 * side]["mean_s"] / rows[side]["mean_s"]
                ours = [self.rendered("maspar-mp1-1k", "columns", s, hold, "20,20,20") for s in (2 * side, side)]
                # All but starting is linear in the samples of a processor. The mean of angles has slightly more of that.
                self.assertWithin(ours[0] / ours[1], printed, 1.06, f"{hold} {side}")
            for row in rows.values():
                self.assertTrue(row["min_s"] < row["mean_s"] < row["max_s"])

    def test_linear_and_nearest_samples_differ_by_the_counted_operations(self):
        # Table 6, 3D: forward with first-order hold 61 operations (rule 15, inverse 15, 3 roundings, 7 interpolations of 3, 7 local
        # reads) and one send; backward with zero-order hold 18 (inverse 15, 3 roundings) and one read. At 0 degrees nothing meets.
        counted = (15 + 15 + 3 + 3 * 7 + 7) - (15 + 3)
        operation = self.unit("maspar-mp1-1k", "operation")  # fitted to warps: tables 10, 11 and 13
        for row in table(27):
            if row["filter"] == "foh":
                nearest = by_filter(27, size=row["size"])["zoh"]
                each = (row["min_s"] - nearest["min_s"]) / (row["size"] ** 3 / 1024)
                self.assertWithin(each / operation, counted, 1.06, f"Table 27, {row['size']}")
        for axes in ("x", "y", "z", "xyz"):
            rows = by_filter(23, axes=axes)
            each = (rows["foh"]["deg0_ms"] - rows["zoh"]["deg0_ms"]) / 1e3 / (128 ** 3 / 16384)
            # Slice and dice has more bookkeeping a sample.
            self.assertWithin(each / operation, counted, 1.16, f"Table 23, {axes}")

    def test_table_23_sends_each_sample_once_beyond_no_turn(self):
        # Units are fitted to warps: tables 10, 11, 13, 14 and 17. What a turn by 80 degrees adds is a send a sample (forward) or a read that others wait for (backward), about one axis.
        send = self.unit("maspar-mp1-16k", "global")
        wait = self.unit("maspar-mp1-16k", "congestion")
        for row in table(23):
            added = (row["deg80_ms"] - row["deg0_ms"]) / 1e3 / (128 ** 3 / 16384)
            expected = send * (wait if row["filter"] == "zoh" else 1)
            # About three axes messages meet more often.
            self.assertWithin(added, expected, QUARTER if row["axes"] != "xyz" else 1.7, f"{row['filter']} {row['axes']}")
            times = [row["deg0_ms"], *(row[turn] for turn in TURNS)]
            self.assertEqual(times, sorted(times))

    def test_table_23_linear_over_nearest(self):
        for axes, turn in (("x", "{0},0,0"), ("y", "0,{0},0"), ("z", "0,0,{0}"), ("xyz", "{0},{0},{0}")):
            rows = by_filter(23, axes=axes)
            for degrees in (40, 80):
                ours = [self.rendered("maspar-mp1-16k", "slice-and-dice", 128, hold, turn.format(degrees)) for hold in ("foh", "zoh")]
                printed = [rows[hold][f"deg{degrees}_ms"] for hold in ("foh", "zoh")]
                self.assertWithin(ours[0] / ours[1], printed[0] / printed[1], QUARTER ** 2, f"{axes} {degrees}")

    def test_tables_23_and_27_sixteen_times_the_processors(self):
        for hold, times in (("foh", 17), ("zoh", 22)):
            rows = [row for row in table(23) if row["filter"] == hold]
            fast = [row[turn] / 1e3 for row in rows for turn in ("deg0_ms", *TURNS)]
            printed = by_filter(27, size=128)[hold]["mean_s"] / (sum(fast) / len(fast))
            self.assertAlmostEqual(printed, times, delta=0.5)
            # More than 16, as columns (27) wait for each other where slice and dice (23) does not.
            ours = [sum(self.rendered(machine, layout, 128, hold, turn) for turn in ALL_TURNS) for machine, layout in
                    (("maspar-mp1-1k", "columns"), ("maspar-mp1-16k", "slice-and-dice"))]
            self.assertGreater(ours[0] / ours[1], 16)
            self.assertWithin(ours[0] / ours[1], printed, QUARTER ** 2, hold)

    def test_tables_28_and_30_columns_against_slice_and_dice(self):
        columns, slices = by_filter(28), by_filter(30)
        for hold in WAYS:
            # The mean is within a half, the greatest is 3.4 to 4.7 times that of slice and dice.
            self.assertTrue(1 < columns[hold]["mean_s"] / slices[hold]["mean_s"] < 1.55)
            printed = columns[hold]["max_s"] / slices[hold]["max_s"]
            self.assertTrue(3.4 < printed < 4.8)
            ours = [max(self.rendered("maspar-mp2-4k", layout, 128, hold, turn) for turn in ("80,0,0", "0,80,0", "80,80,80"))
                    for layout in ("columns", "slice-and-dice")]
            # Two fitted and one held-out row: the docs say that the MP-2 can be described, not predicted.
            self.assertWithin(ours[0] / ours[1], printed, 2, hold)
            # By columns, planes that are turned fall on fewer processors: 1 / cos 80 of the accesses meet.
            least = self.rendered("maspar-mp2-4k", "columns", 128, hold, "0,0,0")
            self.assertWithin(ours[0] / least, columns[hold]["max_s"] / columns[hold]["min_s"], QUARTER ** 2, hold)

    def test_table_31_is_of_table_29(self):
        errata = {(128, "zoh"): 0.04}  # printed 7.80, its own times give 7.77
        times = {row["size"]: row for row in table(29)}
        for row in table(31):
            for hold in WAYS:
                quotient = times[row["size"]][f"pe1_{hold}_s"] / times[row["size"]][f"pe32_{hold}_s"]
                self.assertAlmostEqual(row[hold], quotient, delta=errata.get((row["size"], hold), 0.006))

    def test_tables_29_and_31_speedups(self):
        # A speedup grows with the volume.
        printed = {row["size"]: row for row in table(31)}
        times = {row["size"]: row for row in table(29)}
        for hold in WAYS:
            ours = {}
            for side in (32, 64, 128, 256):
                cast = ["--via", f"project.ray_cast/filter={hold}/step=1"]
                one = self.seconds("proteus-32", side, "20,20,20", *cast, "--ranks", "1", "--threads", "1")
                all_32 = self.seconds("proteus-32", side, "20,20,20", "--via", "net.spread/layout=slice-and-dice", *cast)
                ours[side] = one / all_32
                if side in printed:
                    self.assertWithin(ours[side], printed[side][hold], QUARTER ** 2, f"{hold} {side}")
            self.assertEqual(list(ours.values()), sorted(ours.values()), hold)
            self.assertLess(max(ours.values()), 32)
            self.assertLess(printed[64][hold], printed[256][hold])
            if hold == "zoh":  # 32^3 is too small to share: 0.65 in Table 29, which Table 31 leaves out
                self.assertLess(times[32]["pe1_zoh_s"], times[32]["pe32_zoh_s"])
                self.assertLess(ours[32], 1.1)


if __name__ == "__main__":
    unittest.main()
