"""A rubber beam, clamped at one end and pushed at the other: two-dimensional elastodynamics assembled by FEniCSx.

Plane strain, linear and isotropic: rho d2u/dt2 + rho alpha du/dt = div sigma(u), with a vertical force at the free end. Young's
modulus differs between the half at the clamp and the half at the tip. Biquadratic elements; in time the implicit midpoint rule,
second order and without damping of its own. FEniCSx gives the matrices, once; a step solves with them.
"""

from functools import lru_cache

import numpy as np
import starlings
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu
from starlings import Observer, Quantity

LENGTH, HEIGHT = 1.0, 0.1  # m
DENSITY = 1000.0  # kg/m^3
POISSON = 0.4
DRAG = 0.5  # alpha, 1/s
GAUGES = [0.25, 0.5, 0.75, 1.0]  # along the lower edge, m


def matrix(form):
    """The matrix of a bilinear form, without boundary conditions."""
    assembled = fem.petsc.assemble_matrix(fem.form(form))
    assembled.assemble()
    rows, columns, values = assembled.getValuesCSR()
    return csr_matrix((values, columns, rows), shape=assembled.getSize())


class Beam(starlings.Solver):
    """A beam of two halves of different stiffness."""

    parameters = [
        Quantity("E_root", "kPa", role="stiffness", lo=0.0, says="Young's modulus of the half at the clamp."),
        Quantity("E_tip", "kPa", role="stiffness", lo=0.0, says="Young's modulus of the half at the tip."),
    ]
    outputs = [Quantity("deflection", "m", size=len(GAUGES), role="displacement", says="Of the gauges, upwards.")]
    inputs = [Quantity("force", "N/m", role="force", says="At the tip, upwards, per metre of width.")]

    def __init__(self, along: int = 32, dt: float = 0.005) -> None:
        self.dt = dt
        corners = [np.zeros(2), np.array([LENGTH, HEIGHT])]
        domain = mesh.create_rectangle(MPI.COMM_SELF, corners, [along, 2], mesh.CellType.quadrilateral)
        space = fem.VectorFunctionSpace(domain, ("CG", 2))
        self._assemble(domain, space)
        places = space.tabulate_dof_coordinates()[:, :2]
        nodes = [int(np.argmin(np.hypot(places[:, 0] - x, places[:, 1]))) for x in GAUGES]
        self.n = len(self._free)
        self.gauges = np.searchsorted(self._free, [2 * node + 1 for node in nodes])
        self.states = [
            Quantity("displacement", "m", size=self.n, role="displacement"),
            Quantity("velocity", "m/s", size=self.n, role="velocity"),
        ]
        self.observers = [Observer.sdf(self.stiffness, self.gauges)]
        # The particles take turns in one process: the factors of a few are kept.
        self._kept = lru_cache(maxsize=16)(self._factors)

    def _assemble(self, domain, space) -> None:
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        # Moduli are in kPa.
        mu, lame = 1e3 / (2.0 * (1.0 + POISSON)), 1e3 * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
        strain, virtual = ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))
        work = 2.0 * mu * ufl.inner(strain, virtual) + lame * ufl.tr(strain) * ufl.tr(virtual)
        middle = ufl.SpatialCoordinate(domain)[0] - 0.5 * LENGTH
        halves = [ufl.conditional(ufl.lt(middle, 0.0), a, b) for a, b in ((1.0, 0.0), (0.0, 1.0))]
        clamped = fem.locate_dofs_geometrical(space, lambda x: np.isclose(x[0], 0.0))
        every = 2 * space.dofmap.index_map.size_local
        self._free = np.setdiff1d(np.arange(every), [2 * node + i for node in clamped for i in (0, 1)])
        inside = np.ix_(self._free, self._free)
        self._elastic = [matrix(half * work * ufl.dx)[inside] for half in halves]
        self.mass = matrix(DENSITY * ufl.inner(u, v) * ufl.dx)[inside]
        tip = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[0], LENGTH))
        marked = mesh.meshtags(domain, 1, np.sort(tip), np.ones(len(tip), dtype=np.int32))
        up = fem.Constant(domain, PETSc.ScalarType((0.0, 1.0 / HEIGHT)))
        load = ufl.inner(up, v) * ufl.Measure("ds", domain=domain, subdomain_data=marked)(1)
        self._load = fem.petsc.assemble_vector(fem.form(load)).array[self._free].copy()

    def stiffness(self, p):
        """Stiffness of both halves."""
        return sum(e * k for e, k in zip(p, self._elastic))

    def _factors(self, moduli, h):
        """K and the factors of (1 + a h/2) M + h^2/4 K."""
        k = self.stiffness(moduli)
        return k, splu(((1.0 + 0.5 * h * DRAG) * self.mass + 0.25 * h**2 * k).tocsc())

    def step(self, t, h, x, p, u):
        """The implicit midpoint rule, solved for the velocity in the middle of the step."""
        stiff, factors = self._kept(tuple(p), h)
        d, v = x[: self.n], x[self.n :]
        middle = factors.solve(self.mass @ v + 0.5 * h * (self._load * u.force - stiff @ d))
        return np.concatenate([d + h * middle, 2.0 * middle - v])

    def output(self, t, x, p, u):
        return x[self.gauges]


if __name__ == "__main__":
    starlings.serve(Beam)
