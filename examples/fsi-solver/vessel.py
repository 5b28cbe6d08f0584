"""Blood in an elastic vessel, axisymmetric and coupled: mixed finite elements for the fluid, a thin wall, a Windkessel.

In a cylinder of radius R and length L, linear and incompressible, with Poiseuille's friction spread over the section (units are
cm, g, s, dyn/cm^2):

    rho_f du/dt + (8 mu/R^2) u + grad p = 0,   div u = 0                     fluid
    rho_s h dw/dt + c_w w + E h/((1 - nu^2) R^2) eta = p,   d eta/dt = w     wall at r = R, where u_r = w
    p = pi + R_p Q,   C d pi/dt = Q - pi/R_d                                 outlet at z = L, Q through it
    flow through z = 0 given, p the same all over it                         inlet

(Causin, Gerbeau & Nobile 2005 for fluid and wall; Quarteroni, Tuveri & Veneziani 2000 for the outlet). Velocities are in the
lowest space of Raviart & Thomas (1977) on rectangles, pressures constant on each: of a wall element the fluid knows the normal
velocity and the wall the displacement. In time the implicit midpoint rule: one sparse factorisation for each set of moduli.
Next file to read: wall_observers.py.
"""

from functools import lru_cache

import numpy as np
import starlings
from scipy import sparse
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad0, ElementQuadRT0, FacetBasis, LinearForm, MeshQuad, asm
from skfem.helpers import dot
from starlings import Observer, Quantity

from wall_observers import KineticExtension

LENGTH, RADIUS, THICKNESS = 25.0, 1.0, 0.15  # cm
POISSON = 0.5
WALL_DENSITY, DENSITY = 1.1, 1.06  # g/cm^3
VISCOSITY, WALL_DAMPING = 0.035, 2.0e3  # P, dyn s/cm^3
PROXIMAL, DISTAL, COMPLIANCE = 150.0, 1850.0, 1.0e-3  # of the Windkessel: dyn s/cm^5 twice, cm^5/dyn
REGIONS = 5
RING = THICKNESS / ((1.0 - POISSON**2) * RADIUS**2)  # stiffness of a ring for a unit of E, 1/cm


class Fluid:
    """What does not depend on the wall's stiffness: mass, divergence, and fluxes through inlet, outlet and wall.

    Unknowns are the normal velocities of the edges, those of wall and ends positive outward; nothing crosses the axis.
    """

    def __init__(self, along: int, across: int) -> None:
        mesh = MeshQuad.init_tensor(np.linspace(0.0, LENGTH, along + 1), np.linspace(0.0, RADIUS, across + 1))
        velocity = Basis(mesh, ElementQuadRT0(), intorder=4)
        ends = FacetBasis(mesh, velocity.elem, facets=mesh.boundary_facets(), intorder=4)
        ring = 2.0 * np.pi  # length of the circle of r = 1
        mass = asm(BilinearForm(lambda u, v, w: ring * w.x[1] * dot(u, v)), velocity)
        # r div u = r (du_z/dz + du_r/dr) + u_r
        swell = BilinearForm(lambda u, q, w: ring * (w.x[1] * u.div + u[1]) * q)
        divergence = asm(swell, velocity, velocity.with_element(ElementQuad0()))
        outward = asm(LinearForm(lambda v, w: ring * w.x[1] * dot(v, w.n)), ends)
        middle = mesh.p[:, mesh.facets].mean(axis=1)
        kept = np.flatnonzero(middle[1] > 0.1 * RADIUS / across)
        # The unknowns of the element are fluxes through edges: velocities from here on.
        edge = np.hypot(*np.diff(mesh.p[:, mesh.facets], axis=1)[:, 0])
        scale = sparse.diags_array(np.where(outward < 0.0, -edge, edge)).tocsc()[:, kept]
        self.mass = (scale.T @ mass @ scale).tocsc()
        self.divergence = (divergence @ scale).tocsc()
        self.area = (np.abs(outward) * edge)[kept]
        self.n, self.n_pressure = self.divergence.shape[1], self.divergence.shape[0]
        z, r = middle[:, kept]
        self.inlet, self.outlet = (np.where(np.abs(z - end) < 1e-9, self.area, 0.0) for end in (0.0, LENGTH))
        wall = np.flatnonzero(np.abs(r - RADIUS) < 1e-9)
        self.wall = wall[np.argsort(z[wall])]
        self.centres = z[self.wall]

    def solved_with(self, inertia):
        """Factors of the system of velocities, pressures and the inlet's pressure, and the function that solves with them.

        The function takes forces on the velocities and the flow through the inlet, and gives velocities.
        """
        inlet = sparse.csc_array(self.inlet[:, None])
        nothing = sparse.csc_array((self.n_pressure, 1))
        rows = [[inertia, self.divergence.T, inlet], [self.divergence, None, nothing], [inlet.T, nothing.T, None]]
        factors = splu(sparse.block_array(rows, format="csc"))

        def solve(force, inflow=0.0):
            right = np.concatenate([force, np.zeros(self.n_pressure), [-inflow]])
            return factors.solve(right)[: self.n]

        return solve

    def followed(self):
        """How the fluid moves with the least kinetic energy, and the mass that this adds to the wall.

        Velocities for a unit of each wall velocity, [n][n_wall], for a unit of inflow past a wall at rest, [n], and the added mass,
        [n_wall][n_wall].
        """
        solve = self.solved_with(DENSITY * self.mass)
        units = np.zeros((self.n, self.wall.size))
        units[self.wall, np.arange(self.wall.size)] = 1.0
        pushed = np.column_stack([solve(unit) for unit in units.T])
        added = np.linalg.inv(pushed[self.wall])
        extension = pushed @ added
        through = solve(np.zeros(self.n), 1.0)
        return extension, through - extension @ through[self.wall], 0.5 * (added + added.T)


class Vessel(starlings.Solver):
    """Blood in a vessel whose wall differs between five regions of equal length."""

    name = "fsi-solver"
    parameters = [
        *(
            Quantity(f"E{i}", "dyn/cm^2", role="stiffness", lo=0.0, says=f"Young's modulus of region {i} from the inlet.")
            for i in range(1, REGIONS + 1)
        ),
        Quantity("p0", "dyn/cm^2", role="pressure", default=106657.6, says="Pressure of the vessel at rest at the start."),
    ]
    inputs = [Quantity("flow", "cm^3/s", role="flow", says="Into the inlet.")]

    def __init__(self, along: int = 50, across: int = 20, dt: float = 0.005) -> None:
        self.dt = dt
        self.fluid = fluid = Fluid(along, across)
        self.extension, self.past, added = fluid.followed()
        self.wall_area = fluid.area[fluid.wall]
        self.region = np.minimum((fluid.centres * REGIONS / LENGTH).astype(int), REGIONS - 1)
        self.states = [
            Quantity("blood", "cm/s", size=fluid.n, role="velocity", says="Velocities through the edges of the mesh."),
            Quantity("eta", "cm", size=along, role="displacement", says="Of the wall, by element."),
            Quantity("stored", "dyn/cm^2", role="pressure", says="Pressure stored in the Windkessel."),
        ]
        self.outputs = [
            Quantity("displacement", "cm", size=along, role="displacement", says="Of the wall, outward."),
            Quantity("velocity", "cm/s", size=along, role="velocity", says="Of the wall, outward."),
            Quantity("pressure", "dyn/cm^2", role="pressure", says="At the outlet."),
            Quantity("outflow", "cm^3/s", role="flow", says="Through the outlet."),
        ]
        mass = added + np.diag(self.wall_area * WALL_DENSITY * THICKNESS)
        self.observers = [
            Observer.sdf(lambda p: np.diag(self.wall_area * self.rings(p))),
            KineticExtension(mass, self.extension, output="velocity", state="blood"),
        ]
        # The particles take turns in one process: the factors of a few are kept.
        self._kept = lru_cache(maxsize=16)(self._solver)

    def rings(self, p):
        """Stiffness of the wall at each element, dyn/cm^3."""
        return RING * np.asarray(p.array[:REGIONS])[self.region]

    def initial(self, p):
        """At rest under p0, the wall in equilibrium with it; the flow that enters leaves."""
        inflow = self.window.inputs.at(self.window.start).flow
        return {"blood": self.past * inflow, "eta": p.p0 / self.rings(p), "stored": p.p0}

    def _solver(self, rings, h):
        """The mass of fluid and wall over half a step, and the function that solves for the velocities in its middle."""
        fluid, wall = self.fluid, self.fluid.wall
        drag = 8.0 * VISCOSITY / RADIUS**2

        def on_wall(values):
            diagonal = np.zeros(fluid.n)
            diagonal[wall] = self.wall_area * values
            return sparse.diags_array(diagonal)

        mass = (2.0 / h) * (DENSITY * fluid.mass + on_wall(np.full(wall.size, WALL_DENSITY * THICKNESS)))
        relaxed = 1.0 / (1.0 + 0.5 * h / (COMPLIANCE * DISTAL))
        outlet = sparse.csc_array(fluid.outlet[:, None])
        behind = (PROXIMAL + 0.5 * h / COMPLIANCE * relaxed) * (outlet @ outlet.T)
        spring = on_wall(WALL_DAMPING + 0.5 * h * np.asarray(rings))
        return mass.tocsr(), fluid.solved_with((mass + drag * fluid.mass + spring + behind).tocsc()), relaxed

    def step(self, t, h, x, p, u):
        """One step of the midpoint rule."""
        fluid, rings = self.fluid, self.rings(p)
        h = float(f"{h:.12g}")  # steps that are equal but for rounding share their factors
        mass, solve, relaxed = self._kept(tuple(rings), h)
        c, eta, stored = x[: fluid.n], x[fluid.n : -1], x[-1]
        force = mass @ c - fluid.outlet * (stored * relaxed)
        force[fluid.wall] -= self.wall_area * rings * eta
        middle = solve(force, u.flow)
        out = fluid.outlet @ middle
        rate = (out - (stored + 0.5 * h / COMPLIANCE * out) * relaxed / DISTAL) / COMPLIANCE
        return np.concatenate([2.0 * middle - c, eta + h * middle[fluid.wall], [stored + h * rate]])

    def output(self, t, x, p, u):
        c, eta, stored = x[: self.fluid.n], x[self.fluid.n : -1], x[-1]
        out = self.fluid.outlet @ c
        return {
            "displacement": eta,
            "velocity": c[self.fluid.wall],
            "pressure": stored + PROXIMAL * out,
            "outflow": out,
        }


if __name__ == "__main__":
    starlings.serve(Vessel)
