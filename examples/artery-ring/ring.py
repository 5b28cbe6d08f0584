"""A ring of an artery in a soft, viscous gel, pulsating under the pressure inside: two-dimensional elastodynamics.

Plane strain, linear and isotropic: rho d2u/dt2 = div sigma(u), with the pressure on the inner wall and a gel on the outer one
that answers with k_s u + c_s du/dt. Young's modulus differs between three sectors of 120 degrees. Displacements are counted
from the ring at its lowest pressure, so that only the pressure above that loads it. The ring starts in equilibrium with the
pressure of that moment, which is not how a gel that creeps leaves it: an observer forgets the difference. Biquadratic elements
on curved quadrilaterals; in time the two-stage method of Alexander (1977), second order and damping what is faster than a step.
"""

from functools import lru_cache

import numpy as np
import starlings
from scipy.sparse.linalg import splu
from skfem import (
    Basis,
    BilinearForm,
    ElementQuad2,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshQuad,
    MeshQuad2,
    asm,
)
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity
from starlings import Observer, Quantity

INNER, OUTER = 1.0, 1.15  # cm
DENSITY = 1.1  # g/cm^3
POISSON = 0.45
SUPPORT, DRAG = 1.0e4, 2.0e4  # of the gel: dyn/cm^3, dyn s/cm^3
POINTS = 12  # markers on the inner wall
STAGE = 1.0 - 1.0 / np.sqrt(2.0)


def annulus(around: int, through: int) -> MeshQuad2:
    """`around` x `through` curved quadrilaterals, numbered by rows of equal radius."""
    angles = 2.0 * np.pi * np.arange(around) / around
    radii = np.linspace(INNER, OUTER, through + 1)
    points = np.hstack([r * np.vstack([np.cos(angles), np.sin(angles)]) for r in radii])
    left = np.arange(around)
    right = (left + 1) % around
    quads = [np.vstack([left, right, right + around, left + around]) + row * around for row in range(through)]
    mesh = MeshQuad2.from_mesh(MeshQuad(points, np.hstack(quads)))
    places = mesh.doflocs.copy()
    # Nodes in the middle of an arc lie on its chord: out to the circle.
    part = np.arctan2(places[1], places[0]) * around / (2.0 * np.pi)
    between = np.abs(part - np.round(part)) > 0.25
    places[:, between] /= np.cos(np.pi / around)
    return MeshQuad2(places, mesh.t)


class Ring(starlings.Solver):
    """A ring of an artery whose stiffness differs between three sectors."""

    name = "artery-ring"
    parameters = [
        Quantity(f"E_{i}", "dyn/cm^2", role="stiffness", lo=0.0, says=f"Young's modulus of sector {i}.")
        for i in (1, 2, 3)
    ]
    outputs = [Quantity("wall", "cm", size=2 * POINTS, role="displacement", says="Markers: x of each, then y.")]
    inputs = [Quantity("pressure", "dyn/cm^2", role="pressure", says="Above the lowest.")]

    def __init__(self, around: int = 24, through: int = 1, dt: float = 0.005) -> None:
        self.dt = dt
        mesh = annulus(around, through)
        basis = Basis(mesh, ElementVector(ElementQuad2()))
        self.n = basis.N
        self.states = [
            Quantity("displacement", "cm", size=self.n, role="displacement"),
            Quantity("velocity", "cm/s", size=self.n, role="velocity"),
        ]
        self._assemble(mesh, basis)
        self.markers = markers(basis)
        self.observers = [Observer.sdf(self.stiffness, self.markers)]
        # The particles take turns in one process: the factors of a few are kept.
        self._kept = lru_cache(maxsize=16)(self._factors)

    def _assemble(self, mesh: MeshQuad2, basis: Basis) -> None:
        middle = mesh.p[:, mesh.t[:4]].mean(axis=1)
        sector = ((np.arctan2(middle[1], middle[0]) % (2.0 * np.pi)) / (2.0 * np.pi / 3.0)).astype(int)
        unit = linear_elasticity(*lame_parameters(1.0, POISSON))
        parts = [Basis(mesh, basis.elem, elements=np.flatnonzero(sector == i)) for i in range(3)]
        self._elastic = [asm(unit, part) for part in parts]
        weight = BilinearForm(lambda u, v, w: dot(u, v))
        self.mass = DENSITY * asm(weight, basis)
        facets = mesh.boundary_facets()
        distance = np.hypot(*mesh.p[:, mesh.facets[:, facets]].mean(axis=1))
        outer = FacetBasis(mesh, basis.elem, facets=facets[distance > 0.5 * (INNER + OUTER)])
        inner = FacetBasis(mesh, basis.elem, facets=facets[distance < 0.5 * (INNER + OUTER)])
        self._gel = asm(weight, outer)
        # Normals point out of the wall, into the lumen: against the pressure.
        self._load = asm(LinearForm(lambda v, w: -dot(w.n, v)), inner)

    def stiffness(self, p):
        """Stiffness of wall and gel."""
        return sum(e * k for e, k in zip(p, self._elastic)) + SUPPORT * self._gel

    def initial(self, p):
        """In equilibrium with the pressure at the start."""
        pressure = self.window.inputs.at(self.window.start).pressure
        return {
            "displacement": splu(self.stiffness(p).tocsc()).solve(self._load * pressure),
            "velocity": np.zeros(self.n),
        }

    def _factors(self, moduli, h):
        """K and the factors of M + a C + a^2 K, a = STAGE h."""
        k, a = self.stiffness(moduli), STAGE * h
        return k, splu((self.mass + a * DRAG * self._gel + a**2 * k).tocsc())

    def step(self, t, h, x, p, u):
        """Two implicit stages; the second is the result."""
        stiff, factors = self._kept(tuple(p), h)
        d, v = x[: self.n], x[self.n :]

        def stage(d, v, time):
            """Rates of (d, v) at the end of an implicit Euler step of STAGE h."""
            force = self._load * u.at(time).pressure - DRAG * (self._gel @ v) - stiff @ (d + STAGE * h * v)
            acceleration = factors.solve(force)
            return v + STAGE * h * acceleration, acceleration

        d1, v1 = stage(d, v, t + STAGE * h)
        d2, v2 = stage(d + (1.0 - STAGE) * h * d1, v + (1.0 - STAGE) * h * v1, t + h)
        d = d + h * ((1.0 - STAGE) * d1 + STAGE * d2)
        v = v + h * ((1.0 - STAGE) * v1 + STAGE * v2)
        return np.concatenate([d, v])

    def output(self, t, x, p, u):
        return x[self.markers]


def markers(basis: Basis) -> np.ndarray:
    """Degrees of freedom of the markers: x of each, then y."""
    angles = 2.0 * np.pi * np.arange(POINTS) / POINTS
    x, y = basis.doflocs
    nodes = [np.flatnonzero(np.hypot(x - INNER * np.cos(a), y - INNER * np.sin(a)) < 1e-9) for a in angles]
    return np.array([node[0] for node in nodes] + [node[1] for node in nodes])


if __name__ == "__main__":
    starlings.serve(Ring)
