"""A UM-Bridge server: concentration of a drug after a dose was swallowed.

One compartment with absorption of first order (Bateman 1910): a dose D reaches the blood at the rate ka and leaves it at the
rate ke, C(t) = D ka/(V (ka - ke)) (exp(-ke t) - exp(-ka t)). Parameters ka and ke in 1/h, V in L; D = 100 mg at time 0. The
times at which concentrations are asked for come in the configuration.

    pip install umbridge
    python3 absorption.py [PORT]        listens at the port, or at that of the variable PORT
"""

import math
import os
import sys

import umbridge

DOSE = 100.0


class Absorption(umbridge.Model):
    """Three parameters; one concentration per time."""

    def __init__(self):
        super().__init__("absorption")

    def get_input_sizes(self, config):
        return [3]

    def get_output_sizes(self, config):
        return [len(config.get("times", [1.0]))]

    def __call__(self, parameters, config):
        absorbed, eliminated, volume = parameters[0]
        scale = DOSE * absorbed / (volume * (absorbed - eliminated))
        times = config.get("times", [1.0])
        return [[scale * (math.exp(-eliminated * t) - math.exp(-absorbed * t)) for t in times]]

    def supports_evaluate(self):
        return True


if __name__ == "__main__":
    port = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("PORT", "4243")
    umbridge.serve_models([Absorption()], int(port))
