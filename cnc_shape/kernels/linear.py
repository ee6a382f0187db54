# pyright: basic
"""Small dense linear systems, without allocation: as many unknowns as a machine has drives."""

import numpy as np

from cnc_shape.kernels import kernel


@kernel
def pivot_row(work, k):
    """Row from k on with the largest magnitude in column k of `work` (n,n); the first of equals."""
    pivot = k
    for i in range(k + 1, work.shape[0]):
        if abs(work[i, k]) > abs(work[pivot, k]):
            pivot = i
    return pivot


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
        pivot = pivot_row(work, k)
        if work[pivot, k] == 0.0:
            out[:] = np.nan
            return 0.0
        if pivot != k:
            determinant = -determinant
            for j in range(k, n):
                work[k, j], work[pivot, j] = work[pivot, j], work[k, j]
            out[k], out[pivot] = out[pivot], out[k]
        determinant *= work[k, k]
        scale = 1.0 / work[k, k]
        work[k, k] = scale
        for i in range(k + 1, n):
            factor = work[i, k] * scale
            for j in range(k + 1, n):
                work[i, j] -= factor * work[k, j]
            out[i] -= factor * out[k]
    for k in range(n - 1, -1, -1):
        total = out[k]
        for j in range(k + 1, n):
            total -= work[k, j] * out[j]
        out[k] = total * work[k, k]
    return determinant


@kernel
def invert(matrix, out, work):
    """Invert `matrix` by Gauss-Jordan elimination with partial pivoting: into `out`; (n,n) each.

    `matrix` is kept, `work` is scratch. Returns the determinant; where it is 0 `out` is infinite.
    """
    n = matrix.shape[0]
    work[:] = matrix
    out[:] = 0.0
    for i in range(n):
        out[i, i] = 1.0
    determinant = 1.0
    for k in range(n):
        pivot = pivot_row(work, k)
        if work[pivot, k] == 0.0:
            out[:] = np.inf
            return 0.0
        if pivot != k:
            determinant = -determinant
            for j in range(n):
                work[k, j], work[pivot, j] = work[pivot, j], work[k, j]
                out[k, j], out[pivot, j] = out[pivot, j], out[k, j]
        determinant *= work[k, k]
        scale = 1.0 / work[k, k]
        for j in range(n):
            work[k, j] *= scale
            out[k, j] *= scale
        for i in range(n):
            if i != k:
                factor = work[i, k]
                for j in range(n):
                    work[i, j] -= factor * work[k, j]
                    out[i, j] -= factor * out[k, j]
    return determinant


@kernel
def norm(matrix):
    """Largest sum of magnitudes in a column of `matrix` (n,n); nan where an entry is."""
    largest = 0.0
    for j in range(matrix.shape[1]):
        total = 0.0
        for i in range(matrix.shape[0]):
            total += abs(matrix[i, j])
        if not total <= largest:
            largest = total
    return largest


@kernel
def conditions(matrices, rows, columns, number, determinant):
    """Condition number in the 1-norm and determinant of ``diag(rows) matrix diag(columns)``, one by one.

    matrices (n,d,d); rows, columns (d,) weights. Into number, determinant (n,); a singular matrix has the
    number infinity, one with nan has nan.
    """
    size = rows.size
    matrix, inverse, work = np.empty((size, size)), np.empty((size, size)), np.empty((size, size))
    for k in range(matrices.shape[0]):
        for i in range(size):
            for j in range(size):
                matrix[i, j] = rows[i] * matrices[k, i, j] * columns[j]
        determinant[k] = invert(matrix, inverse, work)
        number[k] = norm(matrix) * norm(inverse)
