"""Writes closedLoopHeart_singleVessel_fine.csv: the equations that svZeroDSolver documents for a closed loop with one vessel, from
the file's start over ten periods, in 50000 steps of semi-implicit Euler per period; the last period is written.

The program's own result beside it is made in 99 steps per period, in which its valves, which open and close within a few
milliseconds, are not resolved: it is off by a tenth. Halving the steps here changes nothing in the fourth digit.
"""

import json
import math
from pathlib import Path

HERE = Path(__file__).parent
STEPS, PERIODS, SHOWN = 50_000, 10, 100
# Cosine and sine coefficients of the ventricles' elastance, of the program.
MODES = [
    (0.283748803, 0.0), (0.031830626, -0.374299825), (-0.2094724, -0.01812777), (0.020520047, 0.073971113),
    (0.008316883, -0.047249597), (-0.04167766, 0.003212163), (0.000867323, 0.019441411), (-0.001675379, -0.005565534),
    (-0.011252277, 0.003401432), (-0.000414677, 0.008376795), (0.000253749, -0.00007188), (-0.002584966, 0.001566861),
    (0.000584752, 0.003143555), (0.000028502, -0.000024787), (0.000022961, -0.000007476), (0.000018735, -0.000001281),
    (0.000015573, 0.000001781), (0.000013133, 0.000003494), (0.000011199, 0.000004507), (0.000009634, 0.000005117),
    (0.000008343, 0.000005481), (0.000007265, 0.000005687), (0.000006354, 0.000005789), (0.000005575, 0.000005821),
    (0.000004903, 0.000005805),
]


def atrium(t, period, heart):
    length, end = period * heart["Tsa"], period / heart["tpwave"]
    before = (end - t) % period
    return 0.5 * (1.0 - math.cos(2.0 * math.pi * before / length)) if before <= length else 0.0


def ventricle(t, period):
    angle = 2.0 * math.pi * t / period
    return sum(a * math.cos(k * angle) - b * math.sin(k * angle) for k, (a, b) in enumerate(MODES))


def main():
    file = json.loads((HERE / "closedLoopHeart_singleVessel.json").read_text())
    loop = file["closed_loop_blocks"][0]
    heart, period = loop["parameters"], loop["cardiac_cycle_period"]
    vessel = file["vessels"][0]["zero_d_element_values"]
    outlet = file["boundary_conditions"][0]["bc_values"]
    start = file["initial_condition"]
    dt = period / STEPS
    atria = [atrium(k * dt, period, heart) for k in range(STEPS)]
    ventricles = [ventricle(k * dt, period) for k in range(STEPS)]
    ra, rv, la, lv = (start[f"V_{name}:CLH"] for name in ("RA", "RV", "LA", "LV"))
    lungs, aorta, chamber = start["P_pul:CLH"], 0.0, 0.0
    q_ra = q_rv = q_la = q_lv = q = 0.0

    def passive(side, volume):
        return heart[f"Kxp_{side}"] * (math.exp((volume - heart[f"Vaso_{side}"]) * heart[f"Kxv_{side}"]) - 1.0)

    def through(flow, drop, resistance, inertance):
        # A valve lets nothing back.
        return max((flow + dt / inertance * drop) / (1.0 + dt * resistance / inertance), 0.0)

    rows = []
    shown = {round(STEPS * i / (SHOWN - 1)) for i in range(SHOWN)}
    for k in range(PERIODS * STEPS + 1):
        step = k % STEPS
        a, e = atria[step], ventricles[step]
        p_ra = a * heart["Emax_ra"] * (ra - heart["Vaso_ra"]) + (1.0 - a) * passive("ra", ra)
        p_la = a * heart["Emax_la"] * (la - heart["Vaso_la"]) + (1.0 - a) * passive("la", la)
        p_rv = e * heart["Erv_s"] * (rv - heart["Vrv_u"])
        p_lv = e * heart["Elv_s"] * (lv - heart["Vlv_u"])
        since = k - (PERIODS - 1) * STEPS
        if since in shown:
            rows.append((since * dt, q, aorta, chamber + outlet["Rp"] * q))
        q_ra = through(q_ra, p_ra - p_rv, heart["Rra_v"], heart["Lra_v"])
        q_rv = through(q_rv, p_rv - lungs, heart["Rrv_a"], heart["Lrv_a"])
        q_la = through(q_la, p_la - p_lv, heart["Rla_v"], heart["Lla_v"])
        q_lv = through(q_lv, p_lv - aorta, heart["Rlv_ao"], heart["Llv_a"])
        resistance = vessel["R_poiseuille"] + outlet["Rp"]
        q = (q + dt / vessel["L"] * (aorta - chamber)) / (1.0 + dt * resistance / vessel["L"])
        back = (chamber - p_ra) / outlet["Rd"]
        aorta += dt * (q_lv - q) / heart["Cpa"]
        chamber += dt * (q - back) / outlet["C"]
        lungs += dt * (q_rv - (lungs - p_la) / heart["Rpd"]) / heart["Cp"]
        ra, rv = ra + dt * (back - q_ra), rv + dt * (q_ra - q_rv)
        # As in the program: the flow out of the right ventricle, not that out of the lungs.
        la, lv = la + dt * (q_rv - q_la), lv + dt * (q_la - q_lv)
    lines = ["time,flow_in,pressure_in,pressure_out"]
    lines += [",".join(f"{value:.8g}" for value in row) for row in rows]
    (HERE / "closedLoopHeart_singleVessel_fine.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
