"""The performance model against what it must give by hand, and tools/scaling on one and two ranks."""

import dataclasses
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from scaling_parts import batch, model, report, series  # noqa: E402

PLAIN = model.Machine(name="plain", particle=50e-9, tile=0.0, fixed=0.0, latency=0.0, bandwidth=1e30,
                      gravity_particle=0.0, gravity_node=0.0)


class Model(unittest.TestCase):
    def test_planes_hold_all_matter(self):
        for particles in (1e4, 1e6, 1e9):
            planes = model.planes_with_work(model.Case(particles), 1.0, 0.0)
            # Half a plane at either end belongs to no node there.
            self.assertAlmostEqual(planes.before[-1] / particles, 1.0, delta=2e-3)

    def test_columns_are_those_that_nodes_meet(self):
        for radius in (0.3, 1.0, 4.4, 17.9, 20.0):
            for margin in (0, 2):
                nodes = [n for n in range(-24, 25)]
                met = {((y + a) // 4, (z + b) // 4) for y in nodes for z in nodes if y * y + z * z <= radius**2
                       for a in (-margin, margin) for b in (-margin, margin)}
                self.assertEqual(model.columns(radius, margin), len(met), (radius, margin))
        self.assertEqual(model.columns(-1.0, 2), 0)
        # Rows of blocks y = -2 ... 1, each with the stacks z = -1 and 0.
        self.assertEqual(model.columns(6.0, 0, stack=4), 8)
        # For large discs: area, and margin and blocks around it.
        self.assertAlmostEqual(model.columns(400.0, 2) / ((math.pi * 400**2 + 32 * 400) / 16), 1.0, delta=0.01)

    def test_a_thin_cap_is_there_as_often_as_it_holds_a_layer(self):
        case = model.Case(3e5)
        last = math.floor(0.5 * case.apart + case.radius)
        for plane in (last - 40, last - 1, last):
            height = min(1.0, 0.5 * case.apart + case.radius - plane + 0.5)
            layers = height / case.layers
            found = [model.widest(case, plane, plane, (n + 0.5) / 16) > 0.0 for n in range(16)]
            self.assertAlmostEqual(sum(found) / 16, min(layers, 1.0), delta=1 / 16)
        # Through the centre of a sphere nothing is wider.
        middle = round(0.5 * case.apart)
        self.assertEqual(model.widest(case, middle, middle, 0.3), case.radius + model.RIM)
        self.assertEqual(model.mean_columns(case, middle, middle, 2), model.columns(case.radius + model.RIM, 2))

    def test_a_block_that_is_cut_costs_both_sides(self):
        planes = model.Planes(-2, [0, 1, 2, 3, 4, 5], {-1: 10, 0: 20})
        self.assertEqual(planes.work(0, 5), 35)
        self.assertEqual(planes.work(0, 1) + planes.work(1, 5), 45)
        self.assertEqual(planes.work(0, 2) + planes.work(2, 5), 35)
        self.assertEqual(planes.work(3, 3), 0)

    def test_one_size_gives_back_its_time(self):
        case = model.Case(1e5, interval=0)
        found = model.fit([{"particles": 1e5, "per_cell": case.per_cell, "engine": 7e-3}], (0.0, 1e30))
        self.assertAlmostEqual(model.step(case, found, 1).engine, 7e-3, places=9)
        self.assertAlmostEqual(found.tile, model.TILE * found.particle, places=12)

    def test_cuts_are_the_best(self):
        before = [0, 3, 4, 8, 9, 14, 23, 25, 31]
        for tiles in ({0: 0, 1: 0}, {0: 2, 1: 5}, {0: 12, 1: 1}):
            planes = model.Planes(0, before, tiles)
            ends = [0, *model.cuts(planes, 3), 8]
            most = max(planes.work(a, b) for a, b in zip(ends, ends[1:]))
            best = min(max(planes.work(0, a), planes.work(a, b), planes.work(b, 8))
                       for a in range(9) for b in range(a, 9))
            self.assertEqual(most, best)

    def test_without_messages_the_imbalance_is_all_that_is_lost(self):
        case = model.Case(1e8, interval=0)
        for ranks in (2, 8, 64):
            step = model.step(case, PLAIN, ranks)
            self.assertAlmostEqual(model.speed_up(case, PLAIN, ranks) * step.imbalance / ranks, 1.0, places=9)
            first, last = model.planes_of(case)
            self.assertLess(step.imbalance, 1.0 + 2.5 * ranks / (last - first + 1))

    def test_no_more_ranks_work_than_planes_are(self):
        case = model.Case(1e6, interval=0)
        first, last = model.planes_of(case)
        many = model.step(case, PLAIN, 1024)
        self.assertLessEqual(many.busy_ranks, last - first + 1)
        self.assertLess(many.busy_ranks, 256)

    def test_halo_grows_with_the_area(self):
        # Cut through the middle of a sphere; the margin of a few cells makes it a little less than four times.
        bytes_of = [model.halo_bytes(case, round(0.5 * case.apart), 4) for case in map(model.Case, (1e8, 8e8))]
        self.assertAlmostEqual(bytes_of[1] / bytes_of[0], 4.0, delta=0.25)

    def test_halo_is_that_of_the_program(self):
        # Bytes that the rank with the most sent in the first step, and the weights by which it was cut.
        core = dataclasses.replace(PLAIN, tile=model.TILE * PLAIN.particle)
        for particles, of_two, of_four in ((20000, 28672, 154112), (94648, 41984, 330752), (300000, 48640, 506368),
                                           (1000000, 55296, 1145344)):
            for ranks, sent in ((2, of_two), (4, of_four)):
                said = model.step(model.Case(particles, interval=0), core, ranks)
                self.assertAlmostEqual(sent / said.halo_bytes, 1.0, delta=0.08, msg=(particles, ranks))

    def test_latency_and_bandwidth(self):
        case = model.Case(1e8, interval=0)
        slow = dataclasses.replace(PLAIN, latency=1e-3, bandwidth=1e9)
        step = model.step(case, slow, 4)
        # Two phases with two neighbours.
        self.assertAlmostEqual(step.halo, 4e-3 + step.halo_bytes / 1e9, places=12)
        hidden = model.step(case, dataclasses.replace(slow, hidden=0.9), 4)
        self.assertAlmostEqual(hidden.halo, 0.1 * step.halo, places=12)

    def test_halo_is_hidden_only_behind_what_there_is_to_do(self):
        case = model.Case(1e5, interval=0)
        slow = dataclasses.replace(PLAIN, latency=1.0, hidden=1.0)
        step = model.step(case, slow, 2)
        self.assertGreater(step.halo, 2.0 - step.engine - 1e-9)

    def test_fit_gives_back_what_it_is_given(self):
        truth = model.Machine("truth", 60e-9, 1.5e-6, 0.0, 2e-6, 5e9, 0.7e-6, 20e-9)
        runs = []
        for particles in (2e4, 1e5, 1e6):
            case = model.Case(particles)
            edge = 2 * case.radius / case.mesh_cell
            runs.append({"particles": particles, "per_cell": case.per_cell,
                         "engine": model.step(dataclasses.replace(case, interval=0), truth, 1).engine,
                         "gravity_near": 0.7e-6 * particles, "gravity_mesh": 20e-9 * 16 * edge**3})
        found = model.fit(runs, (truth.latency, truth.bandwidth), "truth")
        for field in dataclasses.fields(truth)[1:]:
            self.assertAlmostEqual(getattr(found, field.name), getattr(truth, field.name),
                                   delta=1e-6 * (getattr(truth, field.name) or 1.0), msg=field.name)

    def test_sizes_that_do_not_tell(self):
        with self.assertRaises(ValueError):
            model.least_squares([[1.0, 2.0], [2.0, 4.0]], [1.0, 2.0])

    def test_predictions_name_all_ranks(self):
        lines = report.predictions(model.H100, sizes=(1e6,))
        self.assertEqual([int(line.split()[0]) for line in lines[2:]], [2**k for k in range(11)])


class Batch(unittest.TestCase):
    def test_ranks_of_jobs(self):
        self.assertIsNone(batch.ranks_of_job({}))
        self.assertEqual(batch.ranks_of_job({"SLURM_NTASKS": "12"}), 12)
        self.assertEqual(batch.ranks_of_job({"PBS_NP": "6"}), 6)
        with tempfile.NamedTemporaryFile("w", suffix=".nodes") as nodes:
            nodes.write("a\na\nb\n")
            nodes.flush()
            self.assertEqual(batch.ranks_of_job({"PBS_NODEFILE": nodes.name}), 3)

    def test_series_ends_at_all_ranks(self):
        self.assertEqual(batch.default_ranks({"SLURM_NTASKS": "12"}, 2), [1, 2, 4, 8, 12])
        self.assertEqual(batch.default_ranks({}, 2), [1, 2])

    def test_commands(self):
        self.assertEqual(batch.command(batch.launcher({}), 4, ["x"]), ["mpirun", "-n", "4", "x"])
        self.assertEqual(batch.launcher({"SLURM_JOB_ID": "1"}).split()[0], "srun")

    def test_oversubscribes_only_here(self):
        self.assertIn("OMPI_MCA_rmaps_base_oversubscribe", batch.environment_for_runs({}))
        self.assertNotIn("OMPI_MCA_rmaps_base_oversubscribe", batch.environment_for_runs({"SLURM_NTASKS": "2"}))
        self.assertEqual(batch.environment_for_runs({"OMP_NUM_THREADS": "4"})["OMP_NUM_THREADS"], "4")


class Arguments(unittest.TestCase):
    def refused(self, *arguments):
        done = subprocess.run([sys.executable, str(ROOT / "tools/scaling"), *arguments], capture_output=True, text=True,
                              check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        return done.stderr.splitlines()[-1]

    def test_folders_that_are_missing_are_told_before_the_runs(self):
        self.assertIn("--scratch nowhere/at: no such folder", self.refused("--scratch", "nowhere/at"))
        self.assertIn("--json nowhere/a.json: its folder does not exist", self.refused("--json", "nowhere/a.json"))
        self.assertIn("--json .: is a folder", self.refused("--json", "."))


class Series(unittest.TestCase):
    def test_strong_series_on_one_and_two_ranks(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "strong.json"
            done = subprocess.run(
                [sys.executable, str(ROOT / "tools/scaling"), "strong", "--ranks", "1", "2", "--particles", "6000",
                 "--steps", "64", "--repeats", "1", "--network", "1e-6", "1e9", "--gravity", "direct", "--program",
                 os.environ["BRECCIA_COMMAND"], "--launcher", os.environ["BRECCIA_MPIRUN"] + " -n {ranks}", "--json",
                 str(out)], capture_output=True, text=True, check=False)
            self.assertTrue(out.exists(), done.stdout + done.stderr)
            results = json.loads(out.read_text())
        self.assertEqual([r["ranks"] for r in results["runs"]], [1, 2])
        one, two = results["runs"]
        self.assertEqual(one["particles"], 6000)
        self.assertEqual(one["halo_bytes_of_first_step"], 0)
        # 64 steps later the spheres touch.
        self.assertLess(two["halo_bytes_of_first_step"], two["slabs"]["halo_bytes_max"])
        self.assertLess(two["slabs"]["imbalance_mean"], 1.3)
        rows = results["model"]["rows"]
        # Fitted to this run.
        self.assertAlmostEqual(rows[0]["predicted"] / rows[0]["measured"], 1.0, delta=0.05)
        # The cut lies where two spheres of a few cells touch: one plane of blocks more or less changes its section by half.
        self.assertLess(abs(math.log(rows[1]["measured_halo_bytes"] / rows[1]["predicted_halo_bytes"])), math.log(2.0))


if __name__ == "__main__":
    unittest.main()
