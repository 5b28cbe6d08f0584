"""Writes the recordings of an elastic tube with known stiffness: the wall's displacement over heart beats.

A tube of 25 rings, in five regions or with a strap, filled with blood, an RCR Windkessel at its outlet; units are cm, g, s, dyn/cm^2. The
inflow is a half sine of 300 cm^3/s that lasts 0.3 s in each beat of 0.8 s. The run starts on its periodic orbit and takes
implicit midpoint steps of 1 ms; the displacement of every ring is kept each 10 ms, with Gaussian noise of a tenth of the
largest pulsatile amplitude.

    flow.csv                  inflow at every step of ten beats
    wall.csv                  ten beats; wall-tissue.csv: three beats of the same tube in tissue; wall-strap.csv: five beats of
                              a tube that is the same all along but for a strap around its first 5 cm, twice as stiff
    initial.csv               the state at time zero; initial-tissue.csv, initial-strap.csv

Standard library only; the seed is fixed, so the script always writes the same files:

    python3 make_data.py
"""

import csv
import math
import random
from pathlib import Path

L, R, H, NU = 25.0, 1.0, 0.15, 0.5
RHO_S, RHO_F, MU, C_W = 1.1, 1.06, 0.035, 2e3
R_P, R_D, C = 150.0, 1850.0, 1e-3
CELLS = 25
YOUNG = [5e6 * 2.0**octave for octave in (0.5, 1.5, -0.5, 0.0, -1.0) for _ in range(CELLS // 5)]  # of every ring
STRAP = [1e7 if j < 5 else 5e6 for j in range(CELLS)]
BEAT, EJECTION, PEAK = 0.8, 0.3, 300.0
STEPS_PER_BEAT, STEPS_PER_SAMPLE = 800, 10
DT = BEAT / STEPS_PER_BEAT
SEED = 1

DX = L / CELLS
AREA = 2.0 * math.pi * R * DX  # of a ring's wall
SECTION = math.pi * R**2


def flow_at(step: int) -> float:
    """Inflow in cm^3/s, rounded as it is written; every beat is the same to the last bit."""
    phase = (step % STEPS_PER_BEAT) * BEAT / STEPS_PER_BEAT
    return round(PEAK * math.sin(math.pi * phase / EJECTION), 4) if phase < EJECTION else 0.0


class Tube:
    """The tube of rings with these moduli in tissue of stiffness k_s and viscosity c_s; its state is displacement, velocity and
    pressure."""

    def __init__(self, young: list[float] = YOUNG, k_s: float = 0.0, c_s: float = 0.0) -> None:
        """Sets up the linear system of one step, which is the same for every step."""
        mass, damping = RHO_S * H, C_W + c_s
        ring = [modulus * H / ((1.0 - NU**2) * R**2) for modulus in young]
        self.stiffness = [k + k_s for k in ring]
        self.inertia = 2.0 * mass / DT
        wall = [(self.inertia + damping + 0.5 * DT * k) / AREA for k in self.stiffness]
        # Faces downstream of each cell; the last one is half as long.
        weight = [DX] * (CELLS - 1) + [0.5 * DX]
        self.fluid = [w * RHO_F / SECTION * 2.0 / DT for w in weight]
        friction = [w * 8.0 * math.pi * MU / SECTION**2 for w in weight]
        self.relaxed = 1.0 / (1.0 + 0.5 * DT / (R_D * C))
        self.filling = 0.5 * DT / C * self.relaxed
        diagonal = [self.fluid[k] + friction[k] + wall[k] for k in range(CELLS)]
        for k in range(CELLS - 1):
            diagonal[k] += wall[k + 1]
        diagonal[-1] += R_P + self.filling
        self.wall = wall
        self.diagonal = diagonal

    def step(self, state: tuple[list[float], list[float], float], q0: float, q1: float):
        """One implicit midpoint step: a tridiagonal system in the mean flows through the faces."""
        eta, w, pi = state
        inflow = 0.5 * (q0 + q1)
        load = [k * e - self.inertia * v for k, e, v in zip(self.stiffness, eta, w)]
        flow, right = q0, []
        for k in range(CELLS):
            flow -= AREA * w[k]
            ahead = load[k + 1] if k + 1 < CELLS else pi * self.relaxed
            right.append(self.fluid[k] * flow + load[k] - ahead)
        right[0] += self.wall[0] * inflow
        pivot = self.diagonal[:]
        for k in range(1, CELLS):
            ratio = self.wall[k] / pivot[k - 1]
            pivot[k] -= ratio * self.wall[k]
            right[k] += ratio * right[k - 1]
        mean = [0.0] * CELLS
        mean[-1] = right[-1] / pivot[-1]
        for k in range(CELLS - 2, -1, -1):
            mean[k] = (right[k] + self.wall[k + 1] * mean[k + 1]) / pivot[k]
        speed = [(a - b) / AREA for a, b in zip([inflow] + mean, mean)]
        pressure = pi * self.relaxed + self.filling * mean[-1]
        return (
            [e + DT * v for e, v in zip(eta, speed)],
            [2.0 * v - old for v, old in zip(speed, w)],
            2.0 * pressure - pi,
        )

    def beat(self, state):
        """One beat later."""
        for step in range(STEPS_PER_BEAT):
            state = self.step(state, flow_at(step), flow_at(step + 1))
        return state

    def periodic_start(self):
        """The state that returns to itself after one beat: the one slow mode, the Windkessel's, is extrapolated away."""
        state = ([0.1] * CELLS, [0.0] * CELLS, 1e5)
        for _ in range(6):
            first = self.beat(self.beat(state))
            second = self.beat(first)
            third = self.beat(second)
            change = third[2] - second[2]
            if abs(change) < 1e-9 * abs(third[2]):
                return third
            share = change / (second[2] - first[2])
            gain = share / (1.0 - share)
            state = (
                [e + gain * (e - old) for e, old in zip(third[0], second[0])],
                [v + gain * (v - old) for v, old in zip(third[1], second[1])],
                third[2] + gain * change,
            )
        return state


def write(name: str, header: list[str], rows) -> None:
    """Writes a CSV file beside this script."""
    with open(Path(__file__).with_name(name), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows(rows)


def record(tube: Tube, beats: int, suffix: str) -> None:
    """Simulates, observes with noise, writes the recording and its initial state."""
    state = tube.periodic_start()
    eta, w, pi = state
    names = [f"eta[{j}]" for j in range(CELLS)] + [f"w[{j}]" for j in range(CELLS)] + ["pi"]
    values = [f"{value:.10g}" for value in [*eta, *w, pi]]
    write(f"initial{suffix}.csv", ["state", "value"], zip(names, values))
    seen, low, high = [eta], eta, eta
    for step in range(beats * STEPS_PER_BEAT):
        state = tube.step(state, flow_at(step), flow_at(step + 1))
        low = [min(a, b) for a, b in zip(low, state[0])]
        high = [max(a, b) for a, b in zip(high, state[0])]
        if (step + 1) % STEPS_PER_SAMPLE == 0:
            seen.append(state[0])
    noise = 0.1 * max(b - a for a, b in zip(low, high))
    print(f"wall{suffix}.csv: noise of {noise:.7g} cm")
    draw = random.Random(SEED)
    rows = []
    for sample, row in enumerate(seen):
        time = sample * STEPS_PER_SAMPLE / 1000
        rows.append([repr(time)] + [f"{value + draw.gauss(0.0, noise):.5f}" for value in row])
    write(f"wall{suffix}.csv", ["time"] + [f"displacement[{j}]" for j in range(CELLS)], rows)


def main() -> None:
    """Writes every file."""
    steps = range(10 * STEPS_PER_BEAT + 1)
    write("flow.csv", ["time", "flow"], ((repr(step / 1000), repr(flow_at(step))) for step in steps))
    record(Tube(), 10, "")
    record(Tube(k_s=2e5, c_s=5e3), 3, "-tissue")
    record(Tube(STRAP), 5, "-strap")


if __name__ == "__main__":
    main()
