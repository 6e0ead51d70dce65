"""A scene that cannot be run ends with exit code 2 and one line that names the place, on any number of ranks."""

import unittest

from command import SCENE, CommandTest, breccia


class BadScenes(CommandTest):
    def assert_refused(self, text, *words, on=(1,)):
        """`on`: two ranks besides for one scene of each kind, those that a parser, a key's table and a check of the whole
        refuse: all ranks go the same way there."""
        scene = self.write_scene(text)
        for ranks in on:
            with self.subTest(ranks=ranks):
                out = self.folder / "out"
                process = breccia("run", scene, "--out", out, ranks=ranks)
                self.assert_fails(process, 2, *words)
                self.assertFalse(out.exists(), "a refused scene leaves no folder")

    def test_missing_file(self):
        for ranks in (1, 2):
            process = breccia("run", self.folder / "absent.toml", "--out", self.folder / "out", ranks=ranks)
            self.assert_fails(process, 2, "absent.toml")

    def test_not_toml(self):
        self.assert_refused(SCENE.replace('end = "100 s"', "end = = 100"), "scene.toml:2", on=(1, 2))

    def test_unknown_key_names_the_nearest(self):
        self.assert_refused(SCENE.replace("radius", "raduis", 1), "scene.toml:12", "raduis", "radius")

    def test_unknown_section_names_the_nearest(self):
        self.assert_refused(SCENE + "[gravty]\ninterval = 8\n", "gravty", "gravity")

    def test_wrong_unit(self):
        self.assert_refused(SCENE.replace('"50 km"', '"50 s"'), "scene.toml:12", "body[0].radius", "length", on=(1, 2))

    def test_missing_unit(self):
        self.assert_refused(SCENE.replace('"50 km"', "50"), "scene.toml:12", "body[0].radius")

    def test_negative_radius(self):
        self.assert_refused(SCENE.replace('"50 km"', '"-50 km"'), "scene.toml:12", "body[0].radius")

    def test_overlapping_bodies(self):
        self.assert_refused(SCENE.replace('"140 km"', '"60 km"'), "target", "impactor", "overlap", on=(1, 2))

    def test_zero_particles(self):
        self.assert_refused(SCENE.replace("particles = 300", "particles = 0"), "scene.toml:13", "body[0].particles")

    def test_wrong_type(self):
        self.assert_refused(SCENE.replace("particles = 300", 'particles = "many"'), "scene.toml:13")

    def test_missing_required_key(self):
        self.assert_refused(SCENE.replace('cell = "10 km"\n', ""), "grid.cell")

    def test_wrong_override(self):
        scene = self.write_scene()
        for ranks in (1, 2):
            process = breccia("run", scene, "--set", "grid.cel=5 km", ranks=ranks, cwd=self.folder)
            self.assert_fails(process, 2, "grid.cel", "grid.cell")
            process = breccia("run", scene, "--set", "grid.cell", ranks=ranks, cwd=self.folder)
            self.assert_fails(process, 2, "grid.cell")

    def test_output_folder_in_use(self):
        scene = self.write_scene()
        out = self.folder / "out"
        out.mkdir()
        (out / "letter.txt").write_text("keep me")
        for ranks in (1, 2):
            process = breccia("run", scene, "--out", out, "--steps", 1, ranks=ranks)
            self.assert_fails(process, 2, str(out))
            self.assertEqual([p.name for p in out.iterdir()], ["letter.txt"])


if __name__ == "__main__":
    unittest.main()
