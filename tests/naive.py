"""Slow twins of the kernels: the definition itself, in plain numpy."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

# --- contour error --------------------------------------------------------------------------------


def curve_points(toolpath, row, shares):
    """Points of a segment at shares of its angle (arcs) or length (lines), (k,3), as programmed."""
    start, end = toolpath.start[row, :3], toolpath.end[row, :3]
    if toolpath.kind[row] != 2:
        return start + shares[:, None] * (end - start)
    center, normal, sweep = toolpath.center[row], toolpath.normal[row], toolpath.sweep[row]
    arm = start - center
    side = np.cross(normal, arm)
    rise = (end - start) @ normal
    end_arm = end - center - rise * normal
    radius = np.linalg.norm(arm) + (np.linalg.norm(end_arm) - np.linalg.norm(arm)) * shares
    if np.linalg.norm(arm) == 0.0:  # a spiral out of its center: turn its end back
        arm = np.cos(sweep) * end_arm - np.sin(sweep) * np.cross(normal, end_arm)
        side = np.cross(normal, arm)
    angle = sweep * shares
    plane = np.cos(angle)[:, None] * arm + np.sin(angle)[:, None] * side
    outward = radius / np.linalg.norm(arm)
    return center + outward[:, None] * plane + shares[:, None] * rise * normal


def places(toolpath, row, shares):
    """Path length at shares of a segment, by the trapezoid rule on a fine polyline."""
    low, high = toolpath.arc_length[row], toolpath.arc_length[row + 1]
    if toolpath.kind[row] != 2:
        return low + shares * (high - low)
    fine = np.linspace(0.0, 1.0, 20_001)
    steps = np.linalg.norm(np.diff(curve_points(toolpath, row, fine), axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return low + (high - low) * np.interp(shares, fine, along / along[-1])


def polyline_distance(point, toolpath, lower, upper):
    """Least distance to a path of lines within the window: every segment, cut by the window, at once."""
    low, high = toolpath.arc_length[:-1], toolpath.arc_length[1:]
    lower, upper = np.clip([lower, upper], 0.0, toolpath.arc_length[-1])
    touched = (high >= lower) & (low <= upper)
    low, high, start = low[touched], high[touched], toolpath.start[touched, :3]
    chord = toolpath.end[touched, :3] - start
    share = ((point - start) * chord).sum(axis=1) / (chord**2).sum(axis=1)
    share = np.clip(
        share, np.clip((lower - low) / (high - low), 0, 1), np.clip((upper - low) / (high - low), 0, 1)
    )
    return np.linalg.norm(start + share[:, None] * chord - point, axis=1).min()


def contour_distance(point, toolpath, lower=-np.inf, upper=np.inf, count=2001, rounds=4):
    """Least distance to the toolpath's points within the window: a fine grid, refined around its best."""
    best = np.inf
    total = toolpath.arc_length[-1]
    lower, upper = min(max(lower, 0.0), total), max(min(upper, total), 0.0)
    for row in range(len(toolpath)):
        if toolpath.arc_length[row + 1] <= toolpath.arc_length[row]:
            continue
        grid = np.linspace(0.0, 1.0, count)
        along = places(toolpath, row, grid)
        inside = (along >= lower - 1e-12) & (along <= upper + 1e-12)
        low = np.interp(lower, along, grid) if along[0] < lower < along[-1] else 0.0
        high = np.interp(upper, along, grid) if along[0] < upper < along[-1] else 1.0
        if not inside.any() and not (along[0] <= lower and upper <= along[-1]):
            continue
        shares = np.linspace(low, high, count)
        for _ in range(rounds):
            distance = np.linalg.norm(curve_points(toolpath, row, shares) - point, axis=1)
            best = min(best, distance.min())
            middle, width = shares[distance.argmin()], 2.0 * (shares[1] - shares[0])
            shares = np.linspace(max(low, middle - width), min(high, middle + width), count)
    return best


# --- servo loop -----------------------------------------------------------------------------------


def foot_on_lines(toolpath, point, lower, upper):
    """Nearest point of straight lines to `point` (3,) mm between two places on the path, by trying all."""
    best, foot = np.inf, None
    total = toolpath.arc_length[-1]
    lower, upper = min(max(lower, 0.0), total), max(min(upper, total), 0.0)
    for row in range(len(toolpath)):
        a, b = toolpath.start[row, :3], toolpath.end[row, :3]
        low, high = toolpath.arc_length[row], toolpath.arc_length[row + 1]
        if high <= low or high < lower or low > upper:
            continue
        first, last = max(lower - low, 0.0) / (high - low), min(upper - low, high - low) / (high - low)
        share = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), first, last)
        at = a + share * (b - a)
        if np.linalg.norm(point - at) < best:
            best, foot = np.linalg.norm(point - at), at
    return foot


def estimated(coupling, error, tangent, curvature, tool, toolpath, window):
    """The contour error as a vector from the tool to the path, the way the loop guesses it."""
    kind = coupling.estimator.name
    if kind == "FOOT_POINT":
        return foot_on_lines(toolpath, tool, *window) - tool
    if kind == "CIRCLE" and np.linalg.norm(curvature) > 1e-6:
        radius = 1 / np.linalg.norm(curvature)
        normal = curvature * radius
        arm = -error - radius * normal  # from the centre to the tool
        flat = (arm @ tangent) * tangent + (arm @ normal) * normal
        beside = error - (error @ tangent) * tangent - (error @ normal) * normal
        return (radius / np.linalg.norm(flat) - 1) * flat + beside
    return error - (error @ tangent) * tangent


def servo_loop(command, axes, loop, kinematics=None, drives=None, toolpath=None, reach=None):
    """The loop with lag drives as matrices over lists: one expm a period and axis, terms as formulas.

    With a kinematics, joints move the axes and the tool is the drives' position.
    """
    from scipy.linalg import expm

    T, n = loop.sample_time, len(command)
    joints = [axis.drive for axis in axes] if kinematics is None else drives
    modes = [axis.modes if kinematics is None else () for axis in axes] + [()] * len(joints)
    systems = []
    for drive, own in zip(joints, modes, strict=False):
        size = 2 + 2 * len(own)
        M = np.zeros((size + 1, size + 1))
        M[0, 1], M[1, 1] = 1, -1 / drive.time_constant
        M[1, size] = drive.gain / drive.time_constant
        for k, mode in enumerate(own):
            w = 2 * np.pi * mode.natural_frequency
            M[2 + 2 * k, 3 + 2 * k] = 1
            M[3 + 2 * k, 2 + 2 * k], M[3 + 2 * k, 3 + 2 * k] = -w * w, -2 * mode.damping_ratio * w
            M[3 + 2 * k] -= mode.participation * M[1]
        systems.append(expm(M * T))
    if kinematics is None:
        reference, rate = command.position, command.velocity
        jacobians = [np.eye(len(joints))] * n
    else:
        pose, motion = (np.zeros((n, len(kinematics.axes))) for _ in range(2))
        pose[:, : len(axes)], motion[:, : len(axes)] = command.position, command.velocity
        reference = kinematics.inverse(pose)
        every = [rates(lambda row: kinematics.inverse(row[None])[0], at) for at in pose]
        jacobians = [every[k - k % loop.jacobian_every] for k in range(n)]
        rate = np.array([J @ v for J, v in zip(every, motion, strict=True)])
    states = [np.zeros(2 + 2 * len(own)) for _, own in zip(joints, modes, strict=False)]
    for state, start in zip(states, reference[0], strict=True):
        state[0] = start
    queue = [np.zeros(len(joints)) for _ in range(loop.delay_samples)]
    tangent, curvature, position, tool = np.zeros(3), np.zeros(3), [], []
    integral, before, length_integral, length_before = np.zeros(3), None, 0.0, None
    for k in range(n):
        q = np.array([state[0] for state in states])
        position.append(q)
        tool.append([state[0] + state[2::2].sum() for state in states])
        after = min(k + 1, n - 1)
        next_rate = rate[k + 1] if k + 1 < n else 0 * rate[k]
        phi = reference[k] - q
        speed = np.linalg.norm(command.velocity[k, :3])
        if speed > 0:
            tangent = command.velocity[k, :3] / speed
            bend = command.acceleration[k, :3]
            curvature = (bend - (bend @ tangent) * tangent) / speed**2
        u = (np.array(loop.joint_gains) if loop.joint_gains else loop.position_gain) * phi
        if loop.feedforward:
            mean_v = (reference[after] - reference[k]) / T
            mean_a = (next_rate - rate[k]) / T
            for i, drive in enumerate(joints):
                u[i] += (
                    loop.feedforward.velocity * mean_v[i]
                    + loop.feedforward.acceleration * drive.time_constant * mean_a[i]
                ) / drive.gain
        if coupling := loop.cross_coupling:
            e = np.linalg.solve(jacobians[k], phi)
            window = None
            if reach:
                s = command.arc_length
                window = (
                    s[max(k - reach.back, 0)] - reach.margin,
                    s[min(k + reach.ahead, n - 1)] + reach.margin,
                )
            at = command.position[k, :3] - e[:3]
            eps = estimated(coupling, e[:3], tangent, curvature, at, toolpath, window)
            if coupling.form.name == "VECTOR":
                change = 0 * eps if before is None else (eps - before) / T
                w = coupling.proportional * eps + coupling.integral * integral + coupling.derivative * change
                integral, before = integral + T * eps, eps
                integral = integral - (integral @ tangent) * tangent
            else:
                size = np.linalg.norm(eps)
                change = 0.0 if length_before is None else (size - length_before) / T
                w = (
                    coupling.proportional * size
                    + coupling.integral * length_integral
                    + coupling.derivative * change
                )
                w = w * eps / size if size > 0 else 0 * eps
                length_integral, length_before = length_integral + T * size, size
            u += jacobians[k] @ np.concatenate([w, coupling.orientation * e[3:]])
        queue.append(u)
        now = queue.pop(0)
        states = [(S @ np.append(x, w))[:-1] for S, x, w in zip(systems, states, now, strict=True)]
    return np.array(position), np.array(tool)


def delayed_sum(time, sample_time, position, velocity, shaper, delay):
    """A shaped position at `time`, s: the sum of scipy's Hermite cubics through the samples, each delayed."""
    from scipy.interpolate import CubicHermiteSpline

    curve = CubicHermiteSpline(np.arange(position.size) * sample_time, position, velocity)
    end = (position.size - 1) * sample_time
    return sum(
        a * curve(np.clip(time - t - delay, 0, end))
        for t, a in zip(shaper.times, shaper.amplitudes, strict=True)
    )


# --- planner: polyline, hats, time law, samples ------------------------------------------------------


def deviations(toolpath, points, at, reach):
    """Distance of each point to the programmed curve within `reach` mm of its own place on it."""
    vertices, along = [], []
    for row in range(len(toolpath)):
        if toolpath.arc_length[row + 1] > toolpath.arc_length[row]:
            shares = np.linspace(0.0, 1.0, 2 if toolpath.kind[row] != 2 else 4001)
            vertices.append(curve_points(toolpath, row, shares))
            along.append(places(toolpath, row, shares))
    vertices, along = np.concatenate(vertices), np.concatenate(along)
    a, b = vertices[:-1], vertices[1:]
    chord = b - a
    square = np.maximum((chord * chord).sum(axis=1), 1e-300)
    distance = np.empty(len(points))
    for n, (point, place) in enumerate(zip(points[:, :3], at, strict=True)):
        near = slice(
            np.searchsorted(along[1:], place - reach),
            np.searchsorted(along[:-1], place + reach, side="right"),
        )
        arm = point - a[near]
        share = np.clip((arm * chord[near]).sum(axis=1) / square[near], 0.0, 1.0)
        distance[n] = np.sqrt(((arm - share[:, None] * chord[near]) ** 2).sum(axis=1).min())
    return distance


def chords(points, tolerance, window):
    """Greedy chords over the vertices `points`: indices of the vertices that stay."""
    kept, first = [0], 0
    while first < len(points) - 1:
        best = first + 1
        for last in range(first + 2, min(first + window, len(points) - 1) + 1):
            chord = points[last] - points[first]
            inner = points[first + 1 : last] - points[first]
            progress = inner @ chord / (chord @ chord)
            off = np.linalg.norm(inner - progress[:, None] * chord, axis=1)
            if (np.diff(np.concatenate([[0.0], progress, [1.0]])) < 0.0).any() or (off > tolerance).any():
                break
            best = last
        kept.append(best)
        first = best
    return kept


def hat_sums(u, width, size):
    """Sum over all hats of ``size l (1 - |x|)^3 / 6`` at every vertex; and how many others reach it."""
    x = np.abs(u[:, None] - u[None, :]) / np.where(width > 0.0, width, 1.0)
    reaches = (x < 1.0) & (width > 0.0) & (size > 0.0)
    terms = np.where(reaches, size * width * (1.0 - np.minimum(x, 1.0)) ** 3 / 6.0, 0.0)
    return terms.sum(axis=1), reaches.sum(axis=1) - np.diag(reaches)


def hat_widths(u, budget, size, first_width, rounds, shrink):
    """Rounds of Lipschitz limit and shrinking, between two ends that have no hat; all pairs looked at."""
    width = first_width.copy()
    between = 0.5 * np.abs(u[:, None] - u[None, :])

    def limited(width):
        inner = width[1:-1]
        return np.concatenate([[0.0], (inner[None, :] + between[1:-1, 1:-1]).min(axis=1), [0.0]])

    for number in range(rounds):
        width = limited(width)
        total, others = hat_sums(u, width, size)
        excess = np.where((others > 0) & (budget > 0.0), total / np.where(budget > 0.0, budget, 1.0), 0.0)
        factor = np.where(
            excess > 1.0 + 1e-9,
            shrink / np.maximum(excess, 1e-300) ** (1.0 if number == rounds - 1 else 0.5),
            1.0,
        )
        if (factor == 1.0).all():
            break
        reaches = np.abs(u[:, None] - u[None, :]) < width[None, :]
        least = np.where(reaches, factor[:, None], 1.0).min(axis=0)
        width = np.where(size > 0.0, width * least, width)
    return limited(width)


def hat_path(points, tangent, u, width, at):
    """Points of ``P(u) + sum_i D_i l_i (1 - |x|)^3 / 6`` at the parameters `at`, by the formula itself."""
    edge = np.clip(np.searchsorted(u, at, side="right") - 1, 0, len(tangent) - 1)
    q = points[edge] + tangent[edge] * (at - u[edge])[:, None]
    for i in range(1, len(tangent)):
        if width[i] > 0.0:
            x = np.abs(at - u[i]) / width[i]
            q += np.where(x < 1.0, width[i] * (1.0 - np.minimum(x, 1.0)) ** 3 / 6.0, 0.0)[:, None] * (
                tangent[i] - tangent[i - 1]
            )
    return q


def cell_rows(coefficients, h):
    """Rows ``alpha a + beta x0`` of one cell whose size must stay below the axis's acceleration."""
    first, second, third = coefficients[1], 2.0 * coefficients[2], 6.0 * coefficients[3]
    end1, end2 = first + h * second + 0.5 * h * h * third, second + h * third
    alpha = np.concatenate([first, first + 1.5 * h * second, end1 + 2.0 * h * end2])
    beta = np.concatenate([second, 0.5 * (second + end2), end2])
    return alpha, beta


def along_rows(coefficients, h, limit):
    """Rows ``alpha a + beta x0`` of one cell whose size must stay below 1: the acceleration along the path.

    ``q' . (q' a + q'' (x0 + 2 a s))`` over the limit times t . q', coefficient by coefficient.
    """
    first = np.array([coefficients[1], 2.0 * coefficients[2] * h, 3.0 * coefficients[3] * h**2])[:, :3].T
    second = np.array([2.0 * coefficients[2], 6.0 * coefficients[3] * h])[:, :3].T
    both = (first[:, 0] + first.sum(axis=1)) / np.linalg.norm(first[:, 0] + first.sum(axis=1))
    square = sum(np.convolve(row, row) for row in first)
    product = sum(np.convolve(row, bend) for row, bend in zip(first, second, strict=True))
    room = limit * bernstein([*(both @ first), 0.0, 0.0])
    alpha = bernstein(square + 2.0 * h * np.append(0.0, product)) / room
    return alpha, bernstein(np.append(product, 0.0)) / room


def fastest(path, limit_v2, acceleration, along=None):
    """Squared speeds at the nodes by linear programs, one a cell: backward, then forward, from rest."""
    from scipy.optimize import linprog

    n = len(path)
    cap = np.minimum(np.append(limit_v2[:, 0], 0.0), np.concatenate([[0.0], limit_v2[:, 1]]))
    cap[:n][path.stop] = 0.0
    cap[n] = 0.0

    def best(k, x0, x1, sense):
        h = path.length[k]
        alpha, beta = cell_rows(path.coefficients[k], h)
        bound = np.tile(acceleration, 3)
        if along is not None:
            more = along_rows(path.coefficients[k], h, along)
            alpha, beta = np.append(alpha, more[0]), np.append(beta, more[1])
            bound = np.append(bound, np.ones(5))
        left = np.vstack(
            [np.column_stack([alpha, beta]), -np.column_stack([alpha, beta]), [2 * h, 1], [-2 * h, -1]]
        )
        right = np.concatenate([bound, bound, [x1, 0.0]])
        cost = [0.0, -1.0] if sense == "backward" else [-1.0, 0.0]
        scale = np.array([1000.0, 1000.0])
        result = linprog(
            np.array(cost) * scale, left * scale, right, bounds=[(None, None), (x0[0] / 1e3, x0[1] / 1e3)]
        )
        a, x = result.x * scale
        return x if sense == "backward" else x0[0] + 2 * h * a

    reach = np.zeros(n + 1)
    for k in range(n - 1, -1, -1):
        if path.length[k] > 0.0:
            reach[k] = best(k, (0.0, cap[k]), reach[k + 1], "backward")
    speed = np.zeros(n + 1)
    for k in range(n):
        if path.length[k] > 0.0:
            speed[k + 1] = best(k, (speed[k], speed[k]), reach[k + 1], "forward")
    return reach, speed


def samples(profile, times):
    """Position, velocity and acceleration at `times`, each from the piece it lies in, by powers."""
    piece = np.clip(np.searchsorted(profile.time, times, side="right") - 1, 0, len(profile) - 1)
    result = []
    for t, m in zip(times, piece, strict=True):
        e = t - profile.time[m]
        a, j = profile.acceleration[m], profile.jerk[m]
        s = np.polyval([j / 6, a / 2, profile.velocity[m], profile.u[m]], e)
        v, b = np.polyval([j / 2, a, profile.velocity[m]], e), np.polyval([j, a], e)
        c = profile.path.coefficients[profile.cell[m]]
        first, second = c[1] + 2 * c[2] * s + 3 * c[3] * s**2, 2 * c[2] + 6 * c[3] * s
        result.append([c[0] + c[1] * s + c[2] * s**2 + c[3] * s**3, first * v, first * b + second * v**2])
    return np.array(result).transpose(1, 0, 2)


def excesses(profile, limits, points):
    """Largest ratio of velocity, acceleration and feed to their limits, piece by piece."""
    worst = np.zeros(3)
    for m in range(len(profile)):
        k = profile.cell[m]
        times = profile.time[m] + profile.duration[m] * np.linspace(0.0, 1.0, points)
        e = times - profile.time[m]
        v = profile.velocity[m] + profile.acceleration[m] * e
        s = profile.u[m] + profile.velocity[m] * e + 0.5 * profile.acceleration[m] * e**2
        c = profile.path.coefficients[k]
        first = c[1] + np.outer(s, 2 * c[2]) + np.outer(s**2, 3 * c[3])
        second = 2 * c[2] + np.outer(s, 6 * c[3])
        velocity = first * v[:, None]
        acceleration = first * profile.acceleration[m] + second * (v**2)[:, None]
        alone = profile.path.stretch[k] == 0.0
        feed = np.linalg.norm(velocity[:, 3:] if alone else velocity[:, :3], axis=1)
        worst = np.maximum(
            worst,
            [
                max((np.abs(velocity) / [limit.velocity for limit in limits]).max(), 0.0),
                (np.abs(acceleration) / [limit.acceleration for limit in limits]).max(),
                feed.max() / profile.path.feed_rate[k],
            ],
        )
    return worst


# --- extremes of recorded signals -----------------------------------------------------------------


def extremes(measures, width):
    """Rows where a measure, (k,n), is largest in its bucket of `width` rows; the first of equals."""
    buckets = range(0, measures.shape[1], width)
    return np.unique([low + m[low : low + width].argmax() for low in buckets for m in measures])


def sample_measures(rows, axes):
    """What makes a sample worth keeping, (8,n), from its columns."""
    command, drive, tool, velocity, acceleration = (rows[:, k * axes : k * axes + 3] for k in range(5))
    command_error, drive_error, tool_error = rows[:, 5 * axes : 5 * axes + 3].T
    squares = [((a - b) ** 2).sum(axis=1) for a, b in ((command, drive), (tool, drive), (velocity, 0.0))]
    worst = np.abs(acceleration).max(axis=1)
    return np.array([tool_error, drive_error, command_error, -tool_error, *squares, worst])


# --- running sums, speed limits, polygons, ideal drives ---------------------------------------------


def squares(values):
    """Sum of the squares of each column, (d,), in the order of the rows."""
    total = [0.0] * values.shape[1]
    for row in values.tolist():
        total = [old + x * x for old, x in zip(total, row, strict=True)]
    return np.array(total)


def largest_ratio(values, limit):
    """Largest ``|value| / limit`` of any row and column; nan if any is."""
    return (np.abs(values) / limit).max(initial=0.0)


def bernstein(powers):
    """Bernstein coefficients on [0, 1] of a polynomial, from those of its powers, lowest first."""
    from math import comb

    n = len(powers) - 1
    return np.array([sum(comb(i, k) / comb(n, k) * powers[k] for k in range(i + 1)) for i in range(n + 1)])


def speed_limits(rows, length, feed_rate, alone, velocity):
    """Squared speed limits at both ends of a curved cell, from its polynomials in powers of s / length.

    First each end by itself; then both lowered by the largest Bernstein coefficient of ``q'^2 x`` over its
    limit. A cell that is run through at |q'| = 1 has the feed itself as a limit.
    """
    slopes = np.array([rows[1], 2.0 * rows[2] * length, 3.0 * rows[3] * length**2]).T
    squares = [np.convolve(slope, slope) for slope in slopes]
    path = sum(square for i, square in enumerate(squares) if (i < 3) != alone)
    stretch = np.sqrt(bernstein(path).max())
    full = 0.98 < stretch <= 1.0 + 2e-7
    caps = []
    for powers in ([1.0, 0.0, 0.0], [1.0, 1.0, 1.0]):
        ratios = [1e6, *(most / abs(slope @ powers) for slope, most in zip(slopes, velocity, strict=True))]
        along = 1.0 if full else np.sqrt(path[0] if powers[1] == 0.0 else path.sum())
        caps.append(min([*ratios, feed_rate / along]) ** 2)
    line = [caps[0], caps[1] - caps[0]]
    excess = [1.0 if full else bernstein(np.convolve(path, line)).max() / feed_rate**2]
    excess += [
        bernstein(np.convolve(square, line)).max() / most**2
        for square, most in zip(squares, velocity, strict=True)
    ]
    return np.array(caps) / max(*excess, 1.0)


def tangent_polygon(radius, rise, sweep, edges):
    """Corners of the polygon about a circle or helix: where tangents at equal steps meet, seen from above."""
    touch = np.linspace(0.0, sweep, edges)
    corners = []
    for a, b in pairwise(touch):
        left = np.array([[np.cos(a), np.sin(a)], [np.cos(b), np.sin(b)]])  # p . n = radius on each tangent
        corners.append([*np.linalg.solve(left, [radius, radius]), rise * 0.5 * (a + b) / sweep])
    return np.array(corners)


def ideal_tool(command, axis):
    """Tool of an axis whose drive is where it is told: each mode shaken by the cubic between samples.

    One matrix exponential a mode, of ``w'' = -2 zeta omega w' - omega^2 w - p q''``, q'' and its slope states.
    """
    from scipy.linalg import expm

    T = command.sample_time
    tool = command.position[:, 0].copy()
    for mode in axis.modes:
        omega, p = 2 * np.pi * mode.natural_frequency, mode.participation
        M = np.array(
            [[0, 1, 0, 0], [-(omega**2), -2 * mode.damping_ratio * omega, -p, 0], [0, 0, 0, 1], [0, 0, 0, 0]]
        )
        S, state = expm(M * T), np.zeros(4)
        for k in range(len(tool) - 1):
            tool[k] += state[0]
            (q0, q1), (v0, v1) = command.position[k : k + 2, 0], command.velocity[k : k + 2, 0]
            start = 6 * (q1 - q0) / T**2 - (4 * v0 + 2 * v1) / T
            end = -6 * (q1 - q0) / T**2 + (2 * v0 + 4 * v1) / T
            state = S @ [state[0], state[1], start, (end - start) / T]
        tool[-1] += state[0]
    return tool


# contour and path shaping


def smoothed_offset(velocity, acceleration, gain, sample_time, width, at):
    """Value at time `at` of the offset normal to the motion, smoothed by a triangle of half width `width`.

    Samples from t = 0 are joined by straight lines; before and after them there is nothing. Quadrature.
    """
    offsets = []
    for v, a in zip(velocity, acceleration, strict=True):
        pushed = gain * a
        along = v if np.linalg.norm(v) > 1e-9 else a
        size = np.linalg.norm(along)
        unit = along / size if size > 0 else 0.0 * along
        offsets.append(pushed - unit * (unit @ pushed))
    offsets = np.array(offsets)
    known = np.arange(len(offsets)) * sample_time
    borders = np.unique(np.concatenate([known, [at - width, at, at + width]]))
    borders = borders[(borders >= at - width) & (borders <= at + width)]
    nodes, weights = np.polynomial.legendre.leggauss(3)
    total = np.zeros(offsets.shape[1])
    for low, high in pairwise(borders):
        for node, weight in zip(nodes, weights, strict=True):
            t = (low + high) / 2 + node * (high - low) / 2
            value = np.array([np.interp(t, known, column) for column in offsets.T])
            total += weight * (high - low) / 2 * value * (1 - abs(t - at) / width) / width
    return total


def along_path(travelled, speed, acceleration, start, length, rows):
    """Axes of a path of cubic cells at values of its parameter, by the chain rule; it rests beyond its ends."""
    out = []
    for u, v, a in zip(travelled, speed, acceleration, strict=True):
        k = max(max((i for i in range(len(start)) if start[i] <= u), default=0), 0)
        s = u - start[k]
        if not 0 <= s <= length[k]:
            s, v, a = min(max(s, 0.0), length[k]), 0.0, 0.0
        cubic = [np.polynomial.Polynomial(rows[k][:, i]) for i in range(rows.shape[2])]
        position = [p(s) for p in cubic]
        velocity = [p.deriv()(s) * v for p in cubic]
        pushed = [p.deriv()(s) * a + p.deriv(2)(s) * v**2 for p in cubic]
        out.append((position, velocity, pushed))
    return tuple(np.array(values) for values in zip(*out, strict=True))


# --- live shaping ---------------------------------------------------------------------------------


def filtered(samples, weights):
    """FIR filter of one axis, from rest at the first sample to rest at the last: the sum as it is written."""
    longest = len(weights) - 1
    out = []
    for n in range(len(samples) + longest):
        total = 0.0
        for k, weight in enumerate(weights):
            if weight != 0.0:
                total += weight * samples[min(max(n - k, 0), len(samples) - 1)]
        out.append(total)
    return np.array(out)


# --- straight pieces of a sampled motion ------------------------------------------------------------


def knots(points, directions, slack, rest):
    """Numbers of the samples where straight pieces meet: each chord held against every sample it passes."""
    still = [0] * len(points)  # periods without motion up to each sample
    for k in range(1, len(points)):
        still[k] = still[k - 1] + 1 if np.array_equal(points[k], points[k - 1]) else 0
    found = [0]
    for k in range(1, len(points)):
        first, passed = found[-1], np.arange(found[-1] + 1, k)
        chord = points[first] + np.outer((passed - first) / (k - first), points[k] - points[first])
        if still[k] >= rest:
            begin = k - still[k]
        elif still[k] == 0 and still[k - 1] >= rest:
            begin = k - 1
        elif (np.abs((points[passed] - chord) @ directions.T) > slack).any():
            begin = k - max(still[k], 1)
        else:
            continue
        if begin > first:
            found.append(begin)
    return np.array([*found, len(points) - 1])


# --- kinematics -----------------------------------------------------------------------------------


def turned(pose):
    """Orientation of a pose: turns about the fixed axes x, y, z in that order."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("xyz", pose[3:]).as_matrix()


def leg_joints(pose, legs):
    """Joints of six legs: the foot slides up to where the leg just spans to the platform, by bisection."""
    from scipy.optimize import brentq

    joints = []
    for d, origin, point, length in zip(legs.direction, legs.origin, legs.point, legs.length, strict=True):
        span = pose[:3] + turned(pose) @ point - origin
        if not d.any():
            joints.append(np.linalg.norm(span))
            continue

        def excess(q, span=span, d=d, length=length):
            return np.linalg.norm(span - q * d) - length

        nearest = span @ d  # the rail passes the leg's end here
        joints.append(
            brentq(excess, nearest - 2 * length, nearest, xtol=1e-13) if excess(nearest) < 0 else np.nan
        )
    return np.array(joints)


def pose_of(joints, near, inverse):
    """Pose whose joints these are, by MINPACK's hybrid method."""
    from scipy.optimize import fsolve

    return fsolve(lambda pose: inverse(pose) - joints, near, xtol=1e-13)


def rates(function, axes, step=1e-3):
    """Derivative of one row's values by each axis: central differences of fourth order."""
    columns = []
    for unit in step * np.eye(len(axes)):
        near = function(axes + unit) - function(axes - unit)
        far = function(axes + 2 * unit) - function(axes - 2 * unit)
        columns.append((8 * near - far) / (12 * step))
    return np.stack(columns, axis=1)


def leg_twists(legs, position, rotation):
    """Twist per joint rates: all six chains at once as one linear system in twist and passive rates."""
    result = []
    for active in range(6):
        matrix, right = np.zeros((36, 36)), np.zeros(36)
        for i in range(6):
            d, end = legs.direction[i], position + rotation @ legs.point[i]
            s = end - legs.origin[i]
            along = s @ d
            s = s - d * (along - np.sqrt(legs.length[i] ** 2 - s @ s + along**2))
            u = np.cross(d, [0.3, 0.5, 0.8])
            row = slice(6 * i, 6 * i + 6)
            matrix[row, :6] = np.eye(6)
            for k, (axis, r) in enumerate(
                [(u, end - s), (np.cross(u, s), end - s), *((e, end) for e in np.eye(3))]
            ):
                axis = axis / np.linalg.norm(axis)
                screw = [*np.cross(axis, position - r), *axis]  # omega x (tool - r)
                matrix[row, 6 + 5 * i + k] = -np.array(screw)
            if i == active:
                right[6 * i : 6 * i + 3] = d
        result.append(np.linalg.lstsq(matrix, right, rcond=None)[0][:6])
    return np.stack(result, axis=1)


def trilateration(centres, radius):
    """Lower point at one distance from three centres (3,3), as surveyors do it: in the centres' own plane."""
    first = centres[1] - centres[0]
    d = np.linalg.norm(first)
    ex = first / d
    second = centres[2] - centres[0]
    i = ex @ second
    ey = second - i * ex
    j = np.linalg.norm(ey)
    ey = ey / j
    x = d / 2
    y = (i * i + j * j) / (2 * j) - i / j * x
    up = np.cross(ex, ey)
    return centres[0] + x * ex + y * ey - np.sqrt(radius**2 - x * x - y * y) * up * np.sign(up[2])


def tilted(vector, a, c, pivot):
    """A point of the workpiece in the machine: exponentials of the turns about z, then x, at the pivot."""
    from scipy.linalg import expm

    about_x = expm(a * np.array([[0, 0, 0], [0, 0, -1], [0, 1, 0]]))
    about_z = expm(c * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]]))
    return about_x @ about_z @ (vector - pivot) + pivot


# --- stability ------------------------------------------------------------------------------------


def coupled_tick(drives, control, inverse_jacobian, tangent, state):
    """One tick of the loop around a standing command, written term by term.

    state: (q, v, integral, error before, commands on their way); all drives lag.
    """
    q, v, integral, before, late = state
    coupling, period = control.cross_coupling, control.sample_time
    across = np.eye(3) - np.outer(tangent, tangent)
    phi = -q
    e = np.linalg.solve(inverse_jacobian, phi)
    eps = across @ e[:3]
    w = coupling.proportional * eps + coupling.integral * integral
    w = w + coupling.derivative * (eps - before) / period
    told = control.position_gain * phi
    told = told + inverse_jacobian @ np.concatenate([w, coupling.orientation * e[3:]])
    integral = across @ (integral + period * eps)
    late = [*late, told]
    heard, late = late[0], late[1:]
    moved, sped = np.empty_like(q), np.empty_like(v)
    for i, drive in enumerate(drives):
        al = np.exp(-period / drive.time_constant)
        be = drive.time_constant * (1.0 - al)
        moved[i] = q[i] + be * v[i] + drive.gain * (period - be) * heard[i]
        sped[i] = al * v[i] + (1.0 - al) * drive.gain * heard[i]
    return moved, sped, integral, eps, late


# --- limits along the path ----------------------------------------------------------------------------


def curvatures(coefficients, s):
    """Curvature of XYZ at places `s` of a cell."""
    first = coefficients[1] + np.outer(s, 2 * coefficients[2]) + np.outer(s**2, 3 * coefficients[3])
    second = 2 * coefficients[2] + np.outer(s, 6 * coefficients[3])
    crossed = np.cross(first[:, :3], second[:, :3])
    return np.linalg.norm(crossed, axis=1) / np.linalg.norm(first[:, :3], axis=1) ** 3


def chord_speed(curvature, period, error):
    """Speed at which a chord of one period is as far off as is allowed."""
    radius = 1.0 / curvature if curvature > 0.0 else np.inf
    if radius == np.inf:
        return np.inf
    chord = 2.0 * np.sqrt(error * (2.0 * radius - error)) if radius > error else 2.0 * error
    return chord / period


def path_excesses(profile, path_limits, points):
    """Largest ratios of the acceleration along the path, and of the speed to that of its curvature."""
    worst = np.zeros(2)
    for m in range(len(profile)):
        k = profile.cell[m]
        if profile.path.stretch[k] == 0.0:
            continue
        for t in profile.time[m] + profile.duration[m] * np.linspace(0.0, 1.0, points):
            e = t - profile.time[m]
            b = profile.jerk[m]
            s = profile.u[m] + profile.velocity[m] * e + 0.5 * profile.acceleration[m] * e**2 + b * e**3 / 6
            v = profile.velocity[m] + profile.acceleration[m] * e + b * e**2 / 2
            c = profile.path.coefficients[k]
            first, second = c[1] + 2 * c[2] * s + 3 * c[3] * s**2, 2 * c[2] + 6 * c[3] * s
            tangent = first[:3] / np.linalg.norm(first[:3])
            push = abs(tangent @ (first * (profile.acceleration[m] + b * e) + second * v**2)[:3])
            allowed = np.inf
            if path_limits.chord is not None:
                allowed = chord_speed(curvatures(c, np.array([s]))[0], *path_limits.chord)
            speed = np.linalg.norm(first[:3]) * v
            worst = np.maximum(worst, [push / path_limits.acceleration, speed / allowed])
    return worst


def chord_errors(position, per_chord):
    """Largest distance of fine samples (n,3) from the chord they belong to, chord by chord."""
    errors = []
    for first in range(0, len(position) - per_chord, per_chord):
        start, end = position[first], position[first + per_chord]
        span = float((end - start) @ (end - start))
        inside = position[first : first + per_chord + 1]
        share = np.clip((inside - start) @ (end - start) / span, 0.0, 1.0) if span > 0.0 else 0.0
        foot = start + np.multiply.outer(np.atleast_1d(share), end - start)
        errors.append(np.linalg.norm(inside - foot, axis=1).max())
    return np.array(errors)


# --- modes over position ----------------------------------------------------------------------------


def vibration_over_position(axes, joint, rate, told, sample_time):
    """Deflection of every axis, (n,j): one matrix exponential a sample, mode and axis.

    joint, rate (n+1,j): position and velocity of the drives at the samples; told (n,j): what those with a lag
    were told. Those without one run along the cubic through both samples.
    """
    from scipy.linalg import expm

    names, T = [axis.name for axis in axes], sample_time
    bent = np.zeros((len(told), len(axes)))
    for j, axis in enumerate(axes):
        for mode in axis.modes:
            state = np.zeros(2)
            for k in range(len(told)):
                bent[k, j] += state[0]
                frequency, zeta, table = mode.natural_frequency, mode.damping_ratio, mode.table
                if table:
                    x = joint[k, names.index(table.axis)] if table.axis in names else 0.0
                    frequency = np.interp(x, table.position, table.natural_frequency)
                    zeta = np.interp(x, table.position, table.damping_ratio)
                omega = 2.0 * np.pi * frequency
                M = np.zeros((4, 4))  # deflection, its rate, the drive's acceleration, its slope
                M[0, 1], M[1] = 1.0, [-(omega**2), -2.0 * zeta * omega, -mode.participation, 0.0]
                if hasattr(axis.drive, "time_constant"):
                    M[2, 2] = -1.0 / axis.drive.time_constant
                    push = [(axis.drive.gain * told[k, j] - rate[k, j]) / axis.drive.time_constant, 0.0]
                else:
                    M[2, 3] = 1.0
                    step, v0, v1 = joint[k + 1, j] - joint[k, j], rate[k, j], rate[k + 1, j]
                    push = [
                        6.0 * step / T**2 - (4.0 * v0 + 2.0 * v1) / T,
                        6.0 * (v0 + v1) / T**2 - 12.0 * step / T**3,
                    ]
                state = (expm(M * T) @ [*state, *push])[:2]
    return bent


# --- disturbances -------------------------------------------------------------------------------------


def burst(t, frequency, length, centre):
    """A burst of a sine under a cosine-squared window, over its largest value on a fine grid."""

    def shape(late):
        return np.sin(2 * np.pi * frequency * late) * np.cos(np.pi * late / length) ** 2

    peak = np.abs(shape(np.linspace(-length / 2, length / 2, 400_001))).max()
    return np.array([shape(x - centre) / peak if abs(x - centre) < length / 2 else 0.0 for x in t])


def pulse_train(t, start, rise, hold, gap, peaks):
    """Pulses with raised-cosine edges, each at its own place, added up."""
    total = np.zeros(len(t))
    for peak in peaks:
        for k, x in enumerate(np.asarray(t) - start):
            if 0.0 <= x < rise:
                total[k] += peak * (1.0 - np.cos(np.pi * x / rise)) / 2.0
            elif rise <= x < rise + hold:
                total[k] += peak
            elif rise + hold <= x < rise + hold + rise:
                total[k] += peak * (1.0 + np.cos(np.pi * (x - rise - hold) / rise)) / 2.0
        start += rise + hold + rise + gap
    return total


def carried(vector, before, after):
    """A vector under the smallest rotation from one unit vector to another, by Rodrigues' formula."""
    axis, cosine = np.cross(before, after), before @ after
    sine = np.linalg.norm(axis)
    if sine < 1e-9:
        return vector
    axis = axis / sine
    return vector * cosine + np.cross(axis, vector) * sine + axis * (axis @ vector) * (1.0 - cosine)


def windowed(values, share):
    """Every value's sum of itself and all before it under exponential weights, from zero on."""
    weights = share * (1.0 - share) ** np.arange(len(values))
    return np.array([np.tensordot(weights[k::-1], values[: k + 1], 1) for k in range(len(values))])


def path_frames(velocity, acceleration, period, still, share):
    """Tangent, normal and binormal of every sample, (n,3,3)."""
    n = len(velocity)
    speed = np.linalg.norm(velocity, axis=1)
    moves = speed > still
    tangent = np.zeros((n, 3))
    tangent[moves] = velocity[moves] / speed[moves, None]
    toward = np.zeros((n, 3))  # the centre, where there is one
    if share == 0.0:
        for k in np.flatnonzero(moves):
            across = acceleration[k] - (acceleration[k] @ tangent[k]) * tangent[k]
            curvature = np.linalg.norm(across) / speed[k] ** 2
            if curvature > 1e-6 and np.linalg.norm(across) > 1e-10 * np.linalg.norm(acceleration[k]):
                toward[k] = across / np.linalg.norm(across)
    else:
        ends = np.flatnonzero(np.diff(np.concatenate([[False], moves, [False]]).astype(int)))
        for first, end in ends.reshape(-1, 2):
            if end - first < 2:
                continue
            turns = windowed(np.diff(tangent[first:end], axis=0), share)
            mean = windowed(turns, share)
            square = windowed((turns**2).sum(axis=1), share)
            step = windowed(speed[first + 1 : end] * period, share)
            for k in range(first + 1, end):
                bend = mean[k - first - 1]
                bend = bend - (bend @ tangent[k]) * tangent[k]
                size = np.linalg.norm(bend)
                if size > 1e-6 * step[k - first - 1] and size**2 > 0.7 * square[k - first - 1]:
                    toward[k] = bend / size
    frames, last, normal, bent = np.zeros((n, 3, 3)), None, None, False
    for k in range(n):
        if moves[k]:
            if toward[k].any():
                normal, bent = -toward[k], True
            elif bent:
                normal = carried(normal, last, tangent[k])
            else:
                level = np.cross([0.0, 0.0, 1.0], tangent[k])
                if np.linalg.norm(level) <= 1e-6:
                    level = np.cross([1.0, 0.0, 0.0], tangent[k])
                normal = level / np.linalg.norm(level)
            last = tangent[k]
        if last is not None:
            frames[k] = last, normal, np.cross(last, -normal)
    return frames


def random_word(seed, joint, count):
    """Hash of three integers to 64 bits: SplitMix64 seeded by SplitMix64, in whole numbers."""
    every = 2**64 - 1
    golden = 0x9E3779B97F4A7C15

    def finaliser(z):
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & every
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & every
        return z ^ (z >> 31)

    stream = finaliser((finaliser((seed + golden) & every) + (joint + 1) * golden) & every)
    return finaliser((stream + (count + 1) * golden) & every)


def normal_noise(seed, joint, tick):
    """Standard normal value by the transform of Box and Muller, of words 2 tick and 2 tick + 1."""
    one, other = (random_word(seed, joint, 2 * tick + k) // 2**11 for k in (0, 1))
    radius = math.sqrt(-2.0 * math.log((one + 0.5) / 2**53))
    return radius * math.cos(2.0 * math.pi * (other / 2**53))


# --- jerk-limited time law ----------------------------------------------------------------------------


def rest_to_rest(d, v, a, j):
    """Shortest time over `d` from rest to rest within speed, acceleration and jerk; seven phases or fewer."""
    rise = a / j + v / a if v * j >= a * a else 2 * np.sqrt(v / j)
    if v * rise <= d:
        return d / v + rise
    if d >= 2 * a**3 / j**2:
        peak = 2 * a * d / (np.sqrt(a**4 / j**2 + 4 * a * d) + a * a / j)
        return 2 * (a / j + peak / a)
    return 4 * np.cbrt(d / (2 * j))


def law_loads(profile, limits, points):
    """Largest ratios of velocity, acceleration, jerk and feed to their limits, piece by piece."""
    bounds = np.array([[limit.velocity, limit.acceleration, limit.jerk] for limit in limits]).T
    worst = np.zeros(4)
    for m in range(len(profile)):
        k = profile.cell[m]
        e = profile.duration[m] * np.linspace(0.0, 1.0, points)
        b = profile.jerk[m]
        law = np.poly1d([b / 6, profile.acceleration[m] / 2, profile.velocity[m], profile.u[m]])
        s, v, a = law(e), law.deriv()(e), law.deriv(2)(e)
        c = profile.path.coefficients[k]
        third = np.broadcast_to(6 * c[3], (points, len(limits)))
        second = 2 * c[2] + s[:, None] * third
        first = c[1] + 2 * np.outer(s, c[2]) + 3 * np.outer(s**2, c[3])
        asked = [
            first * v[:, None],
            first * a[:, None] + second * (v**2)[:, None],
            first * b + 3 * second * (v * a)[:, None] + third * (v**3)[:, None],
        ]
        alone = profile.path.stretch[k] == 0.0
        feed = np.linalg.norm(asked[0][:, 3:] if alone else asked[0][:, :3], axis=1)
        ratios = [(np.abs(row) / bound).max() for row, bound in zip(asked, bounds, strict=True)]
        worst = np.maximum(worst, [*ratios, feed.max() / profile.path.feed_rate[k]])
    return worst


def highest_below(place, speed, jerk, at):
    """Highest speed at `at` of a law that is nowhere above the points (place, speed) and keeps ``b >= -jerk``.

    It is that of the highest arc ``b = -jerk`` through `at` that stays below the points. Seen from `at`, an
    arc with the speed v there must not rise faster than the points ahead allow, nor come up more slowly than
    those behind do: both bounds of its acceleration are those of single points.
    """
    ahead, behind = place > at, place < at

    def speed_after(v, a, distance):
        rest = (a + np.sqrt(a * a + 2 * jerk * v)) / jerk
        low, high = np.zeros_like(distance), np.full_like(distance, rest)
        if v * rest + a * rest**2 / 2 - jerk * rest**3 / 6 <= distance.min():
            return np.zeros_like(distance)
        for _ in range(30):
            t = 0.5 * (low + high)
            short = v * t + a * t * t / 2 - jerk * t**3 / 6 < distance
            low, high = np.where(short, t, low), np.where(short, high, t)
        return np.maximum(v + a * t - jerk * t * t / 2, 0.0)

    def below(v, a):
        fits = (speed_after(v, a, place[ahead] - at) <= speed[ahead] + 1e-6).all()
        return fits, (speed_after(v, -a, (at - place[behind])[::-1]) <= speed[behind][::-1] + 1e-6).all()

    low, high = 0.0, np.interp(at, place, speed)
    for _ in range(25):
        v = 0.5 * (low + high)
        least, most = -1e5, 1e5
        found = False
        for _ in range(30):
            a = 0.5 * (least + most)
            before_end, after_start = below(v, a)
            if before_end and after_start:
                found = True
                break
            if not before_end and not after_start:
                break
            least, most = (least, a) if not before_end else (a, most)
        low, high = (v, high) if found else (low, v)
    return low


# --- use of the limits ----------------------------------------------------------------------------------


def axis_motion(profile, m):
    """Positions of the axes within a piece as polynomials of the time from its start."""
    law = np.poly1d(
        [profile.jerk[m] / 6, profile.acceleration[m] / 2, profile.velocity[m], profile.u[m]]
    )  # fmt: skip
    return [np.poly1d(column[::-1])(law) for column in profile.path.coefficients[profile.cell[m]].T]


def limit_use(profile, points, width, count):
    """Largest speed, its smallest, and every axis's velocity, acceleration and jerk in buckets of time."""
    found = np.full((count, 2 + 3 * len(profile.path.axes)), -np.inf)
    for m in range(len(profile)):
        e = profile.duration[m] * np.linspace(0.0, 1.0, points)
        axes = axis_motion(profile, m)
        asked = np.array([[np.abs(axis.deriv(n)(e)) for axis in axes] for n in (1, 2, 3)])
        speed = np.linalg.norm(asked[0, :3], axis=0)
        rows = np.vstack([speed, -speed, asked.reshape(-1, points)]).T
        np.maximum.at(found, np.minimum(((profile.time[m] + e) / width).astype(int), count - 1), rows)
    return found


# --- when moves are passed ----------------------------------------------------------------------------


def passing_times(rows, pieces, cells):
    """End of every move: its own event, looked for in all of the law.

    rows: (what, border, dwell); pieces: (time, duration, u, v, a, j, cell); cells: (stop, place, stretch).
    """
    whats = [what for what, _, _ in rows]
    rests = [(t, T) for t, T, _, v, a, j, _ in pieces if T > 0 and v == a == j == 0]
    turns = []  # ends of the cells in which rotary axes move alone
    for n, (t, T, _, v, a, j, k) in enumerate(pieces):
        if cells[k][2] == 0 and (v, a, j) != (0, 0, 0) and (n + 1 == len(pieces) or pieces[n + 1][6] != k):
            turns.append(t + T)
    ends = []
    for n, (what, border, _) in enumerate(rows):
        if what == 0:
            ends.append(_reached(border, pieces, cells))
        elif what == 2:
            ends.append(turns[whats[:n].count(2)])
        else:
            group = n
            while group and whats[group - 1] == 1:
                group -= 1
            first = sum(1 for m in range(1, group + 1) if whats[m - 1] == 1 and whats[m] != 1)
            ends.append(rests[first][0] + sum(rows[m][2] for m in range(group, n + 1)))
    return np.array(ends)


def _reached(border, pieces, cells):
    for t, T, u, v, a, j, k in pieces:
        _, place, stretch = cells[k]
        if stretch == 0 or v == a == j == 0:
            continue
        way = (border - place) / stretch - u
        if abs(v * T + a * T**2 / 2 + j * T**3 / 6 - way) < 1e-9:
            return t + T
        if v * T + a * T**2 / 2 + j * T**3 / 6 > way:
            times = np.linspace(0.0, T, 400_001)
            return t + np.interp(way, v * times + a * times**2 / 2 + j * times**3 / 6, times)
    raise AssertionError(border)


def time_at_feed(pieces, coefficients, feed_rate, alone, share, points=4001):
    """Time in which the speed is at least `share` of the feed, counted."""
    total = 0.0
    for _, T, u, v, a, j, k in pieces:
        e = (np.arange(points) + 0.5) / points * T
        s = u + v * e + a * e**2 / 2 + j * e**3 / 6
        columns = slice(3, None) if alone[k] else slice(0, 3)
        c = coefficients[k][:, columns]
        rate = np.linalg.norm(c[1] + 2 * c[2] * s[:, None] + 3 * c[3] * s[:, None] ** 2, axis=1)
        total += np.count_nonzero(rate * (v + a * e + j * e**2 / 2) >= share * feed_rate[k]) / points * T
    return total


# --- acceptance of the planner ---------------------------------------------------------------------


def row_distance(toolpath, row, points, low, high):
    """Distance of points (n,3) to one segment between two shares of it, (n,) each; arcs are arcs."""
    start, end = toolpath.start[row, :3], toolpath.end[row, :3]
    if toolpath.kind[row] != 2:
        chord = end - start
        share = np.clip((points - start) @ chord / max(chord @ chord, 1e-300), low, high)
        return np.linalg.norm(points - start - share[:, None] * chord, axis=1)
    best = np.full(len(points), np.inf)
    width = high - low
    share = low + 0.5 * width
    for _ in range(5):  # closer and closer about the nearest of a grid
        grid = np.clip(
            share[:, None] + width[:, None] * np.linspace(-0.5, 0.5, 41), low[:, None], high[:, None]
        )
        found = curve_points(toolpath, row, grid.ravel()).reshape(*grid.shape, 3)
        distance = np.linalg.norm(points[:, None] - found, axis=2)
        nearest = distance.argmin(axis=1)
        share = grid[np.arange(len(points)), nearest]
        best = np.minimum(best, distance.min(axis=1))
        width = width / 20.0
    return best


def true_deviations(toolpath, points, at, reach):
    """Distance of each point to the programmed lines and arcs within `reach` mm of its own place; `at` rises."""
    distance = np.full(len(points), np.inf)
    low, high = toolpath.arc_length[:-1], toolpath.arc_length[1:]
    first = np.searchsorted(at, low - reach)
    after = np.searchsorted(at, high + reach, side="right")
    for row in np.flatnonzero((after > first) & (toolpath.kind != 6)):
        near = slice(first[row], after[row])
        length = max(high[row] - low[row], 1e-300)
        begin = np.clip((at[near] - reach - low[row]) / length, 0.0, 1.0)
        finish = np.clip((at[near] + reach - low[row]) / length, 0.0, 1.0)
        distance[near] = np.minimum(
            distance[near], row_distance(toolpath, row, points[near, :3], begin, finish)
        )
    return distance


def end_directions(toolpath, row):
    """Unit vectors along which a segment begins and ends, by differences."""
    points = curve_points(toolpath, row, np.array([0.0, 1e-6, 1.0 - 1e-6, 1.0]))
    directions = np.array([points[1] - points[0], points[3] - points[2]])
    return directions / np.maximum(np.linalg.norm(directions, axis=1), 1e-300)[:, None]


def rests(toolpath):
    """Places at which a program has to rest, mm, both ends included, as it is written."""
    needed, before, waiting = [], None, True
    for row in range(len(toolpath)):
        if toolpath.kind[row] == 6:
            waiting = True
            continue
        travel = toolpath.arc_length[row + 1] - toolpath.arc_length[row]
        alone = travel <= 1e-9
        begin, finish = end_directions(toolpath, row)
        exact = toolpath.path_mode[row] != 2
        rest = waiting or alone
        if before is not None and not rest:
            direction, was_exact, was_alone = before
            angle = np.degrees(np.arctan2(np.linalg.norm(np.cross(direction, begin)), direction @ begin))
            rest = was_alone or angle > 165.0 or ((exact or was_exact) and angle > 1.0)
        if rest:
            needed.append(toolpath.arc_length[row])
        before, waiting = (finish, exact, alone), toolpath.path_mode[row] == 0
    return np.array([*needed, toolpath.arc_length[-1]])


def naive_time(toolpath, limits):
    """Length by feed, and by the speeds of the axes on straight moves, summed; dwells included."""
    total = toolpath.dwell.sum()
    velocity = np.array([limit.velocity for limit in limits])
    for row in range(len(toolpath)):
        if toolpath.kind[row] == 6:
            continue
        travel = toolpath.arc_length[row + 1] - toolpath.arc_length[row]
        change = np.abs(toolpath.end[row] - toolpath.start[row])
        if travel <= 1e-9:
            travel = np.linalg.norm(change[3:])
        total += max(travel / toolpath.feed_rate[row], (change / velocity).max())
    return total


def path_length(path):
    """Length of a path in XYZ, by Gauss-Legendre quadrature of ``|q'|`` over its cells."""
    total = 0.0
    for node, weight in zip(*np.polynomial.legendre.leggauss(8), strict=True):
        e = (0.5 * (1.0 + node) * path.length)[:, None]
        c = path.coefficients[:, :, :3]
        speed = np.linalg.norm(c[:, 1] + e * (2 * c[:, 2] + 3 * e * c[:, 3]), axis=1)
        total += 0.5 * weight * (speed * path.length).sum()
    return total
