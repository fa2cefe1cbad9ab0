"""`--channel DAPI`: channels by the names that files give them. Needs EDGEWISE."""

import json
import pathlib
import sys
import unittest

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parent.parent / "io")]
import files  # noqa: E402
import format_writers as w  # noqa: E402
from running import Running  # noqa: E402


class Names(Running):
    def ome(self, name, names):
        """An OME-TIFF of channels, then slices."""
        channels = "".join('<Channel ID="Channel:0:%d" SamplesPerPixel="1"%s/>' % (c, f' Name="{n}"' if n else "") for c, n in enumerate(names))
        volume = (np.arange(len(names) * 3 * 5 * 6).reshape(len(names), 3, 5, 6) % 250).astype("u1")
        text = w.ome(f'DimensionOrder="XYZCT" Type="uint8" SizeX="6" SizeY="5" SizeZ="3" SizeC="{len(names)}" SizeT="1"', channels=channels, data="<TiffData/>")
        pages = [w.tiff_page(page, more=w.described(text) if i == 0 else None) for i, page in enumerate(volume.reshape(-1, 5, 6))]
        path = self.folder / name
        path.write_bytes(w.tiff(pages))
        return path

    def zarr(self, name, labels):
        path = self.folder / name
        (path / "0").mkdir(parents=True)
        volume = np.arange(len(labels) * 2 * 4 * 5).reshape(len(labels), 2, 4, 5).astype("u1")
        axes = [{"name": "c", "type": "channel"}] + [{"name": a, "type": "space", "unit": "micrometer"} for a in "zyx"]
        (path / ".zgroup").write_text('{"zarr_format": 2}')
        (path / ".zattrs").write_text(json.dumps({
            "multiscales": [{"version": "0.4", "axes": axes, "datasets": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 1, 1, 1]}]}]}],
            "omero": {"channels": [{"label": label, "color": "FFFFFF"} for label in labels]}}))
        (path / "0" / ".zarray").write_text(json.dumps({"zarr_format": 2, "shape": volume.shape, "chunks": volume.shape, "dtype": "|u1", "compressor": None,
                                                        "fill_value": 0, "order": "C", "filters": None, "dimension_separator": "/"}))
        (path / "0" / "0" / "0" / "0").mkdir(parents=True)
        (path / "0" / "0" / "0" / "0" / "0").write_bytes(volume.tobytes())
        return path

    def render(self, path, channel, code=0, *more):
        out = self.folder / "o.png"
        done = self.run_it("render", path, "-o", out, "--channel", channel, "--view", "z", *more, code=code)
        return done.stderr if code else out.read_bytes()

    def test_zarr(self):
        path = self.zarr("a.zarr", ["DAPI", "GFP", "Alexa 568"])
        for number, name in enumerate(("DAPI", "gfp", "alexa 568")):
            self.assertEqual(self.render(path, name), self.render(path, number))
        self.assertEqual(self.render(path, "GFP=red,DAPI=blue"), self.render(path, "1=red,0=blue"))
        self.assertEqual(self.render(path, "DAPI,2"), self.render(path, "0,2"))
        error = self.render(path, "DAPY", 2)
        self.assertIn(b"DAPI, GFP, Alexa 568", error)

    def test_ome_tiff(self):
        path = self.ome("a.ome.tif", ["DAPI", "Cy5 &amp; more", ""])
        for number, name in enumerate(("dapi", "Cy5 & more")):
            self.assertEqual(self.render(path, name), self.render(path, number))
        self.assertIn(b"its channels are DAPI, Cy5 & more", self.render(path, "GFP", 2))

    def test_info_lists_them(self):
        for path, names, said in ((self.zarr("i.zarr", ["DAPI", "GFP", "Alexa 568"]), ["DAPI", "GFP", "Alexa 568"], "0 DAPI, 1 GFP, 2 Alexa 568"),
                                  (self.ome("i.ome.tif", ["DAPI", "", "Cy5 &amp; more"]), ["DAPI", "", "Cy5 & more"], "0 DAPI, 2 Cy5 & more"),
                                  (self.ome("six.ome.tif", [f"n{c}" for c in range(6)]), [f"n{c}" for c in range(6)], "0 n0, 1 n1, 2 n2, 3 n3, 4 n4, 5 n5"),
                                  (self.ome("one.ome.tif", ["DAPI"]), ["DAPI"], "0 DAPI")):
            self.assertEqual(json.loads(self.run_it("info", path, "--json", "-").stdout)["channel_names"], names)
            self.assertIn(f"\n  channels     {said}\n", self.run_it("info", path).stdout.decode())
            # What is listed is what --channel takes.
            for number, name in enumerate(names):
                if name:
                    self.assertEqual(self.render(path, name), self.render(path, number))
        files.write_nrrd(self.folder / "none.nrrd", np.zeros((2, 3, 4, 3), "u1"))
        for path in (self.folder / "none.nrrd", self.ome("none.ome.tif", ["", ""]), "phantom:cube:8"):
            self.assertEqual(json.loads(self.run_it("info", path, "--json", "-").stdout)["channel_names"], [])
            self.assertNotIn("\n  channels  ", self.run_it("info", path).stdout.decode())

    def test_a_montage_of_channels(self):
        """Each in its colour, then all together where there is room."""
        path = self.zarr("m.zarr", ["DAPI", "GFP", "Cy5"])
        out = self.folder / "m.png"

        def picture(channel, *more):
            self.run_it("render", path, "-o", out, "--channel", channel, "--view", "z", "--spacing", "1", *more)
            return files.read_png(out.read_bytes())[0]

        colours = "0=red,1=#00ff80,2=blue"
        alone = [picture(one) for one in colours.split(",")] + [picture(colours)]
        # One channel with a colour is a picture in that colour.
        height, width = alone[0].shape[:2]
        for columns, rows, count in ((3, 1, 3), (2, 2, 4), (4, 1, 4)):
            sheet = picture(colours, "--montage", f"{columns}x{rows}")
            self.assertEqual(sheet.shape[:2], (rows * (height + 2) - 2, columns * (width + 2) - 2))
            for i in range(count):
                y, x = (i // columns) * (height + 2), (i % columns) * (width + 2)
                np.testing.assert_array_equal(sheet[y:y + height, x:x + width], alone[i])
        self.assertIn(b"do not fit", self.render(path, colours, 2, "--montage", "2x1"))

    def colours(self, path, *words):
        report = json.loads(self.run_it("render", path, "-o", "null:", "--channel", "all", "--view", "z", "--spacing", "1", *words, "--json", "-").stdout)
        return [channel["colour"] for channel in report["channels"]]

    def test_names_of_stains_tell_colours(self):
        red, green, blue, magenta = "#ff0000", "#00ff00", "#0000ff", "#ff00ff"
        for i, (names, expected) in enumerate(((["DAPI", "GFP", "mCherry", "Cy5"], [blue, green, red, magenta]),
                                               (["Hoechst 33342", "Alexa Fluor 488", "AF568", "alexa-647"], [blue, green, red, magenta]),
                                               (["TRITC", "fitc", "EGFP", "Cy3"], [red, green, green, red]),
                                               # What has no known name takes the first colour that no name has taken.
                                               (["DAPI", "actin", "gfp"], [blue, "#ffffff", green]), (["a", "DAPI", "b"], [red, blue, "#ffffff"]),
                                               # None is known; words that only begin like one.
                                               (["actin", "b"], [red, green]), (["DAPI2x", "GFPs are dim"], [red, green]))):
            self.assertEqual(self.colours(self.ome(f"n{i}.ome.tif", names)), expected, names)
            self.assertEqual(self.colours(self.zarr(f"n{i}.zarr", names)), expected, names)

    def test_colours_of_the_file_and_of_the_command_go_first(self):
        path = self.zarr("own.zarr", ["DAPI", "GFP"])
        text = json.loads((path / ".zattrs").read_text())
        for channel, colour in zip(text["omero"]["channels"], ("00FFFF", "FFFF00")):
            channel["color"] = colour
        (path / ".zattrs").write_text(json.dumps(text))
        self.assertEqual(self.colours(path), ["#00ffff", "#ffff00"])
        path = self.zarr("said.zarr", ["DAPI", "GFP"])
        report = json.loads(self.run_it("render", path, "-o", "null:", "--channel", "0=yellow,1", "--view", "z", "--json", "-").stdout)
        self.assertEqual([channel["colour"] for channel in report["channels"]], ["#ffff00", "#00ff00"])

    def test_several_and_none(self):
        self.assertIn(b"0 and 2", self.render(self.zarr("b.zarr", ["x", "y", "X"]), "x", 2))
        self.assertIn(b"names none", self.render(self.zarr("c.zarr", ["", ""]), "DAPI", 2))


if __name__ == "__main__":
    unittest.main()
