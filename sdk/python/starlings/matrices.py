"""What observers do with mass and stiffness, dense or of scipy.sparse.

Next file to read: observers.py.
"""

from __future__ import annotations

from typing import Any, Callable, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from .values import Array, Values

#: Positions in an array.
Places = NDArray[np.intp]

#: A matrix, dense or of scipy.sparse, or a function of the parameters that gives one.
Matrix = Any
MatrixOf = Union[Matrix, Callable[[Values], Matrix]]


def extension(
    stiffness: Matrix, observed: Union[Sequence[int], Places], fixed: Union[Sequence[int], Places] = ()
) -> Array:
    """The displacement of least elastic energy for a unit at each observed degree of freedom, [n][n_observed].

    The identity on `observed` (increasing), zero on `fixed`, and -K_uu^-1 K_uo on the others. `stiffness` is n × n, dense or
    of scipy.sparse. Source: Moireau, Chapelle & Le Tallec 2009, section 3.
    """
    n = stiffness.shape[0]
    known = np.asarray(observed, dtype=np.intp)
    free = np.setdiff1d(np.arange(n), np.concatenate([known, np.asarray(fixed, dtype=np.intp)]))
    extended = np.zeros((n, known.size))
    extended[known, np.arange(known.size)] = 1.0
    if free.size and known.size:
        rows = _by_rows(stiffness)[free]
        extended[free] = -factor(rows[:, free])(_dense(rows[:, known]))
    return extended


def evaluated(of: MatrixOf, p: Values, n: int, name: str) -> Matrix:
    """The n × n matrix at these parameters, by rows; ValueError with its `name` where the size is another."""
    matrix = of(p) if callable(of) else of
    if not _sparse(matrix):
        matrix = np.asarray(matrix, dtype=np.float64)
    if matrix.shape != (n, n):
        raise ValueError(f"{name} is {' × '.join(map(str, matrix.shape))}; the state makes it {n} × {n}")
    return _by_rows(matrix)


def _sparse(matrix: Matrix) -> bool:
    return hasattr(matrix, "tocsr")


def _by_rows(matrix: Matrix) -> Matrix:
    return matrix.tocsr() if _sparse(matrix) else matrix


def _dense(matrix: Matrix) -> Array:
    dense: Array = np.asarray(matrix.toarray() if _sparse(matrix) else matrix, dtype=np.float64)
    return dense


def added(matrix: Matrix, place: Places, block: Matrix, times: float) -> Matrix:
    """The matrix with `times` times the block added on rows and columns `place`."""
    if not _sparse(matrix):
        summed = np.array(matrix)
        summed[np.ix_(place, place)] += times * _dense(block)
        return summed
    from scipy import sparse

    one = np.ones(place.size)
    lift = sparse.csr_matrix((one, (place, np.arange(place.size))), shape=(matrix.shape[0], place.size))
    return matrix + times * (lift @ sparse.csr_matrix(block) @ lift.T)


def factor(matrix: Matrix) -> Callable[[Array], Array]:
    """Solves with the matrix."""
    if _sparse(matrix):
        from scipy.sparse.linalg import splu

        solve: Callable[[Array], Array] = splu(matrix.tocsc()).solve
        return solve
    return lambda right: np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
