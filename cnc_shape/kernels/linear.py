# pyright: basic
"""Small dense linear systems, without allocation: as many unknowns as a machine has drives."""

import numpy as np

from cnc_shape.kernels import kernel


@kernel
def solve(matrix, right, out, work):
    """Solve ``matrix out = right`` by Gaussian elimination with partial pivoting.

    matrix, work (n,n); right, out (n,). `matrix` and `right` are kept, `work` is scratch. Returns the
    determinant; where it is 0 the matrix is singular and `out` is nan.
    """
    n = right.size
    for i in range(n):
        out[i] = right[i]
        for j in range(n):
            work[i, j] = matrix[i, j]
    determinant = 1.0
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(work[i, k]) > abs(work[pivot, k]):
                pivot = i
        determinant *= work[pivot, k]
        if work[pivot, k] == 0.0:
            out[:] = np.nan
            return 0.0
        if pivot != k:
            determinant = -determinant
            for j in range(k, n):
                work[k, j], work[pivot, j] = work[pivot, j], work[k, j]
            out[k], out[pivot] = out[pivot], out[k]
        inverse = 1.0 / work[k, k]
        for i in range(k + 1, n):
            factor = work[i, k] * inverse
            for j in range(k + 1, n):
                work[i, j] -= factor * work[k, j]
            out[i] -= factor * out[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            out[k] -= work[k, j] * out[j]
        out[k] /= work[k, k]
    return determinant


@kernel
def conditions(matrices, rows, columns, number, determinant):
    """Condition number in the 1-norm and determinant of ``diag(rows) matrix diag(columns)``, one by one.

    matrices (n,d,d); rows, columns (d,) weights. Into number, determinant (n,); a singular matrix has the
    number infinity, one with nan has nan.
    """
    size = rows.size
    matrix, work = np.empty((size, size)), np.empty((size, size))
    unit, column = np.zeros(size), np.empty(size)
    for k in range(matrices.shape[0]):
        norm = 0.0
        for j in range(size):
            total = 0.0
            for i in range(size):
                matrix[i, j] = rows[i] * matrices[k, i, j] * columns[j]
                total += abs(matrix[i, j])
            if not total <= norm:
                norm = total
        inverse_norm = 0.0
        for j in range(size):
            unit[j] = 1.0
            determinant[k] = solve(matrix, unit, column, work)
            unit[j] = 0.0
            total = 0.0
            for i in range(size):
                total += abs(column[i])
            if not total <= inverse_norm:
                inverse_norm = total
        number[k] = np.inf if determinant[k] == 0.0 else norm * inverse_norm
