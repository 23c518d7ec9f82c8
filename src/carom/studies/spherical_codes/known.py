"""Codes that are known exactly for every size: polygons, simplices, and parts of the cross-polytope."""

from __future__ import annotations

from typing import Any

from carom.studies.spherical_codes.newton import GUARD, Digits


def known(n: int, k: int, digits: int) -> tuple[Digits, Any, str] | None:
    """Return coordinates (n, k) and cosine in ``mpmath`` of an optimal code, and what it is; None if unknown.

    Up to k + 1 points the simplex is optimal, and up to 2 k points nothing is better than a right angle
    (Rankin, Proc. Glasgow Math. Assoc. 2 (1955) 139).
    """
    import mpmath

    with mpmath.workdps(digits + GUARD):
        zero, one = mpmath.mpf(0), mpmath.mpf(1)
        if k == 2:
            turns = [2 * mpmath.pi * i / n for i in range(n)]
            corners = [[mpmath.cos(turn), mpmath.sin(turn)] for turn in turns]
            return corners, mpmath.cos(2 * mpmath.pi / n), f"the regular polygon of {n} corners, optimal"
        if n <= k + 1:
            # Rows of the Cholesky factor of the products, which are 1 on the diagonal, else -1 / (n - 1).
            cosine = -one / (n - 1)
            rows = [[zero] * k for _ in range(n)]
            for i in range(n):
                for j in range(min(i, k)):
                    rest = cosine - mpmath.fdot(rows[i][:j], rows[j][:j])
                    rows[i][j] = rest / rows[j][j]
                if i < min(n - 1, k):
                    rows[i][i] = mpmath.sqrt(one - mpmath.fdot(rows[i][:i], rows[i][:i]))
            return rows, cosine, f"the regular simplex of {n} corners, optimal (Rankin 1955)"
        if n <= 2 * k:
            rows = [[zero] * k for _ in range(n)]
            for i in range(n):
                rows[i][i // 2] = one if i % 2 == 0 else -one
            whole = "" if n == 2 * k else f"{n} corners of "
            return rows, zero, f"{whole}the cross-polytope, optimal (Rankin 1955)"
    return None
