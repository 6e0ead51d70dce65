"""`breccia eos` against the Tillotson equation of state written down once more."""

import json
import unittest
from math import exp, sqrt

from command import CommandTest, breccia

# Basalt of Benz & Asphaug (1999).
RHO0, A, B = 2700.0, 2.67e10, 2.67e10
SMALL_A, SMALL_B, E0, E_IV, E_CV, ALPHA, BETA = 0.5, 1.5, 4.87e8, 4.72e6, 1.82e7, 5.0, 5.0


def pressure(density, energy):
    eta = density / RHO0
    mu, nu = eta - 1, 1 / eta - 1
    thermal = SMALL_B * density * energy / (energy / (E0 * eta**2) + 1)
    cold = SMALL_A * density * energy + thermal + A * mu + B * mu**2
    hot = SMALL_A * density * energy + (thermal + A * mu * exp(-BETA * nu)) * exp(-ALPHA * nu**2)
    if eta >= 1 or energy <= E_IV:
        return cold
    if energy >= E_CV:
        return hot
    return ((energy - E_IV) * hot + (E_CV - energy) * cold) / (E_CV - E_IV)


def sound_speed_squared(density, energy):
    """dP/drho + P/rho^2 dP/dE by central differences: error about 1e-10 of the derivative at these steps."""
    h, k = 1e-5 * density, 1e-5 * max(energy, 1e6)
    by_density = (pressure(density + h, energy) - pressure(density - h, energy)) / (2 * h)
    by_energy = (pressure(density, energy + k) - pressure(density, energy - k)) / (2 * k)
    return by_density + pressure(density, energy) / density**2 * by_energy


class Eos(CommandTest):
    STATES = {"comp": (3000.0, 1e6), "cold": (2600.0, 1e6), "mix": (2000.0, 1e7), "hot": (1500.0, 3e7)}

    def state(self, density, energy, ranks=1):
        process = breccia("eos", "basalt", "--density", density, "--energy", energy, "--json", "-", ranks=ranks)
        self.assertEqual((process.returncode, process.stderr), (0, ""))
        return json.loads(process.stdout)

    def test_every_branch(self):
        for branch, (density, energy) in self.STATES.items():
            for ranks in (1, 2):
                with self.subTest(branch=branch, ranks=ranks):
                    state = self.state(density, energy, ranks)
                    self.assertEqual(state["branch"], branch)
                    # Two double evaluations of the same formula, terms of up to 1e11 Pa cancelling.
                    self.assertAlmostEqual(state["pressure"], pressure(density, energy), delta=1e-3)
                    expected = sound_speed_squared(density, energy)
                    self.assertAlmostEqual(state["sound_speed_squared"], expected, delta=1e-6 * abs(expected))
                    self.assertAlmostEqual(
                        state["sound_speed"], sqrt(max(state["sound_speed_squared"], A / RHO0)), delta=1e-9
                    )

    def test_reference_state_is_stress_free(self):
        self.assertEqual(self.state(RHO0, 0)["pressure"], 0.0)
        self.assertAlmostEqual(self.state(RHO0, 0)["sound_speed_squared"], A / RHO0, delta=1e-8)

    def test_text_has_the_same_17_digits(self):
        process = breccia("eos", "basalt", "--density", 3000, "--energy", 1e6)
        self.assertEqual((process.returncode, process.stderr), (0, ""))
        lines = process.stdout.splitlines()
        state = self.state(3000, 1e6)
        self.assertEqual(float(lines[0].split()[-2]), state["pressure"])
        self.assertEqual(lines[-1].split()[-1], state["branch"])

    def test_json_file(self):
        file = self.folder / "state.json"
        process = breccia("eos", "basalt", "--density", 3000, "--energy", 1e6, "--json", file)
        self.assertEqual(process.returncode, 0)
        self.assertEqual(json.loads(file.read_text()), self.state(3000, 1e6))

    def test_wrong_states(self):
        for ranks in (1, 2):
            process = breccia("eos", "granite", "--density", 1, "--energy", 0, ranks=ranks)
            self.assert_fails(process, 2, "granite", "basalt")
            process = breccia("eos", "basalt", "--density", -5, "--energy", 0, ranks=ranks)
            self.assert_fails(process, 2, "density")

    def test_unwritable_json_is_an_output_error(self):
        file = self.folder / "absent" / "state.json"
        for ranks in (1, 2):
            process = breccia("eos", "basalt", "--density", 3000, "--energy", 0, "--json", file, ranks=ranks)
            self.assertEqual(process.returncode, 4)
            self.assertEqual(process.stderr.count("\n"), 1, process.stderr)


if __name__ == "__main__":
    unittest.main()
