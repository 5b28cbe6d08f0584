"""Two tanks in a row as an FMU: a pump fills the first, which drains into the second, which drains away.

Levels h1, h2 in cm, flows in cm^3/s, Torricelli's law with discharge coefficients k1, k2 in cm^2.5/s, cross-sections of
154 cm^2. `build.py` makes tanks.fmu of it.
"""

import math

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real

AREA = 154.0


class Tanks(Fmi2Slave):
    """Two tanks in a row."""

    author = "Starlings"
    description = "Two tanks in a row, filled by a pump."

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.k1, self.k2 = 10.0, 10.0
        self.pump = 0.0
        self.h1, self.h2 = 10.0, 5.0
        self.level1, self.level2 = self.h1, self.h2
        self.default_experiment = DefaultExperiment(start_time=0.0, step_size=1.0)
        for name in ("k1", "k2"):
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
            )
        self.register_variable(Real("pump", causality=Fmi2Causality.input))
        for name in ("h1", "h2"):
            self.register_variable(Real(name, causality=Fmi2Causality.local, initial=Fmi2Initial.exact))
        for name in ("level1", "level2"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        self.level1, self.level2 = self.h1, self.h2

    def rates(self, h1, h2):
        """Rates of both levels."""
        first, second = self.k1 * math.sqrt(max(h1, 0.0)), self.k2 * math.sqrt(max(h2, 0.0))
        return (self.pump - first) / AREA, (first - second) / AREA

    def do_step(self, current_time, step_size):
        """One step of the midpoint rule."""
        a1, a2 = self.rates(self.h1, self.h2)
        b1, b2 = self.rates(self.h1 + 0.5 * step_size * a1, self.h2 + 0.5 * step_size * a2)
        self.h1, self.h2 = self.h1 + step_size * b1, self.h2 + step_size * b2
        self.level1, self.level2 = self.h1, self.h2
        return True
