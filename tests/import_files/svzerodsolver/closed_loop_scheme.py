"""Prints what svZeroDSolver computes for closedLoopHeart_singleVessel.json, by the scheme that it documents, in so many steps per period.

    python3 closed_loop_scheme.py 99        its own number: the digits of results/closedLoopHeart_singleVessel.json
    python3 closed_loop_scheme.py 396       a quarter of the step

The last of ten periods, at 100 times. The scheme is the generalised-α method (Jansen, Whiting & Hulbert 2000) with ρ∞ = 0.5 for
E ẏ + F y + c = 0, whose valves are closed where, at the step's middle time, neither pressure nor flow goes forward; the flow through a closed
valve starts its step from zero.
"""

import json
import math
import sys

from closed_loop_reference import HERE, PERIODS, SHOWN, atrium, ventricle

RHO = 0.5
ALPHA_M, ALPHA_F = 0.5 * (3.0 - RHO) / (1.0 + RHO), 1.0 / (1.0 + RHO)
GAMMA = 0.5 + ALPHA_M - ALPHA_F
TOLERANCE = 1e-8
NAMES = "p_ra q_in p_ao q_out v_ra q_ra p_rv v_rv q_rv p_pul p_la v_la q_la p_lv v_lv q_lv p_out p_c".split()
AT = {name: k for k, name in enumerate(NAMES)}
#: Flow, the pressures that drive it, its inertance and resistance in the file.
VALVES = [
    ("q_ra", "p_ra", "p_rv", "Lra_v", "Rra_v"), ("q_rv", "p_rv", "p_pul", "Lrv_a", "Rrv_a"),
    ("q_la", "p_la", "p_lv", "Lla_v", "Rla_v"), ("q_lv", "p_lv", "p_ao", "Llv_a", "Rlv_ao"),
]


def equations(t, y, period, heart, vessel, outlet):
    """Rows of E, of F with what the atria add to it, and the constant as it stands in the residual; then the closed valves."""
    t = math.fmod(t, period)
    a, e = atrium(t, period, heart), ventricle(t, period)
    closed = {q for q, up, down, _, _ in VALVES if y[AT[up]] <= y[AT[down]] and y[AT[q]] <= 0.0}
    rows = []
    for side in ("ra", "la"):
        full = heart[f"Kxp_{side}"] * math.exp((y[AT[f"v_{side}"]] - heart[f"Vaso_{side}"]) * heart[f"Kxv_{side}"])
        most = a * heart[f"Emax_{side}"]
        rest = most * heart[f"Vaso_{side}"] + (a - 1.0) * (full - heart[f"Kxp_{side}"])
        slope = (a - 1.0) * full * heart[f"Kxv_{side}"]
        rows.append(({}, {f"p_{side}": 1.0, f"v_{side}": -most}, rest, {f"v_{side}": slope}))
    for side in ("rv", "lv"):
        now = e * heart[f"E{side}_s"]
        rows.append(({}, {f"p_{side}": 1.0, f"v_{side}": -now}, now * heart[f"V{side}_u"], {}))
    through = {q: 0.0 if q in closed else 1.0 for q, *_ in VALVES}
    rows += [
        (stored, flows, 0.0, {})
        for stored, flows in [
            ({"p_ao": heart["Cpa"]}, {"q_lv": -through["q_lv"], "q_out": 1.0}),
            ({"v_ra": 1.0}, {"q_ra": through["q_ra"], "q_in": -1.0}),
            ({"v_rv": 1.0}, {"q_ra": -through["q_ra"], "q_rv": through["q_rv"]}),
            ({"v_la": 1.0}, {"q_rv": -through["q_rv"], "q_la": through["q_la"]}),
            ({"v_lv": 1.0}, {"q_la": -through["q_la"], "q_lv": through["q_lv"]}),
            ({"p_pul": heart["Cp"]}, {"q_rv": -through["q_rv"], "p_pul": 1 / heart["Rpd"], "p_la": -1 / heart["Rpd"]}),
            ({"q_out": vessel["L"]}, {"p_ao": -1.0, "p_out": 1.0, "q_out": vessel["R_poiseuille"]}),
            ({}, {"p_out": 1.0, "p_c": -1.0, "q_out": -outlet["Rp"]}),
            ({"p_c": outlet["C"]}, {"q_out": -1.0, "q_in": 1.0}),
            ({}, {"p_c": 1.0, "p_ra": -1.0, "q_in": -outlet["Rd"]}),
        ]
    ]
    for q, up, down, inertance, resistance in VALVES:
        rows.append(({q: heart[inertance]}, {q: heart[resistance] * through[q], up: -1.0, down: 1.0}, 0.0, {}))
    return rows, closed


def solved(matrix, right):
    """Gauss's elimination with the largest pivot of each column."""
    n = len(right)
    rows = [row + [b] for row, b in zip(matrix, right)]
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[best] = rows[best], rows[k]
        pivot = rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / pivot[k]
            if factor != 0.0:
                rows[i] = [x - factor * p for x, p in zip(rows[i], pivot)]
    x = [0.0] * n
    for k in reversed(range(n)):
        x[k] = (rows[k][n] - sum(rows[k][j] * x[j] for j in range(k + 1, n))) / rows[k][k]
    return x


def main():
    steps = int(sys.argv[1])
    file = json.loads((HERE / "closedLoopHeart_singleVessel.json").read_text())
    loop = file["closed_loop_blocks"][0]
    period = loop["cardiac_cycle_period"]
    of = (period, loop["parameters"], file["vessels"][0]["zero_d_element_values"], file["boundary_conditions"][0]["bc_values"])
    dt, n = period / steps, len(NAMES)
    y, rate = [0.0] * n, [0.0] * n
    for name, value in file["initial_condition"].items():
        y[AT[name.removesuffix(":CLH").lower()]] = value
    print("time,flow_in,pressure_in,pressure_out")
    for k in range(PERIODS * steps + 1):
        since = k - (PERIODS - 1) * steps
        if since >= 0 and since * (SHOWN - 1) % steps == 0:
            print(f"{since * dt!r},{y[AT['q_out']]!r},{y[AT['p_ao']]!r},{y[AT['p_out']]!r}")
        new, new_rate = list(y), [(1.0 - 1.0 / GAMMA) * v for v in rate]
        for _ in range(30):
            mid_rate = [v + ALPHA_M * (w - v) for v, w in zip(rate, new_rate)]
            mid = [v + ALPHA_F * (w - v) for v, w in zip(y, new)]
            rows, closed = equations((k + ALPHA_F) * dt, mid, *of)
            residual, jacobian = [], []
            for stored, flows, rest, slope in rows:
                residual.append(
                    rest + sum(v * mid_rate[AT[q]] for q, v in stored.items()) + sum(v * mid[AT[q]] for q, v in flows.items())
                )
                row = [0.0] * n
                for part, weight in ((stored, ALPHA_M), (flows, ALPHA_F * GAMMA * dt), (slope, ALPHA_F * GAMMA * dt)):
                    for q, v in part.items():
                        row[AT[q]] += weight * v
                jacobian.append(row)
            if max(map(abs, residual)) < TOLERANCE:
                break
            change = solved(jacobian, [-r for r in residual])
            for q in closed:
                new[AT[q]] = 0.0
            new_rate = [v + d for v, d in zip(new_rate, change)]
            new = [v + GAMMA * dt * d for v, d in zip(new, change)]
        y, rate = new, new_rate


if __name__ == "__main__":
    main()
