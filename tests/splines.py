"""Splines of one number at a time, for integrations by SciPy."""

from bisect import bisect_right


def of_one_number(spline):
    """A spline as a function of one number: SciPy's own takes most of an integration's time."""
    knots, pieces = spline.x.tolist(), spline.c.T.tolist()

    def value(s):
        k = min(max(bisect_right(knots, s) - 1, 0), len(pieces) - 1)
        piece, s = pieces[k], s - knots[k]
        result = 0.0
        for coefficient in piece:
            result = result * s + coefficient
        return result

    return value
