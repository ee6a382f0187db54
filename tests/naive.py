"""Slow twins of the kernels: the definition itself, in plain numpy."""

from __future__ import annotations

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


def servo_loop(command, axes, loop):
    """The loop with lag drives as matrices over lists: one expm a period and axis, terms as formulas."""
    from scipy.linalg import expm

    T, n = loop.sample_time, len(command)
    systems = []
    for axis in axes:
        tau, gain = axis.drive.time_constant, axis.drive.gain
        size = 2 + 2 * len(axis.modes)
        M = np.zeros((size + 1, size + 1))
        M[0, 1], M[1, 1], M[1, size] = 1, -1 / tau, gain / tau
        for k, mode in enumerate(axis.modes):
            w = 2 * np.pi * mode.natural_frequency
            M[2 + 2 * k, 3 + 2 * k] = 1
            M[3 + 2 * k, 2 + 2 * k], M[3 + 2 * k, 3 + 2 * k] = -w * w, -2 * mode.damping_ratio * w
            M[3 + 2 * k] -= mode.participation * M[1]
        systems.append(expm(M * T))
    states = [np.zeros(2 + 2 * len(axis.modes)) for axis in axes]
    for state, start in zip(states, command.position[0], strict=True):
        state[0] = start
    queue = [np.zeros(len(axes)) for _ in range(loop.delay_samples)]
    tangent, position, tool = np.zeros(3), [], []
    for k in range(n):
        q = np.array([state[0] for state in states])
        position.append(q)
        tool.append([state[0] + state[2::2].sum() for state in states])
        after = min(k + 1, n - 1)
        next_velocity = command.velocity[k + 1] if k + 1 < n else 0 * command.velocity[k]
        error = command.position[k] - q
        speed = np.linalg.norm(command.velocity[k, :3])
        if speed > 0:
            tangent = command.velocity[k, :3] / speed
        u = loop.position_gain * error
        if loop.feedforward:
            mean_v = (command.position[after] - command.position[k]) / T
            mean_a = (next_velocity - command.velocity[k]) / T
            for i, axis in enumerate(axes):
                u[i] += (
                    loop.feedforward.velocity * mean_v[i]
                    + loop.feedforward.acceleration * axis.drive.time_constant * mean_a[i]
                ) / axis.drive.gain
        if loop.cross_coupling:
            u[:3] += loop.cross_coupling.proportional * (error[:3] - (error[:3] @ tangent) * tangent)
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
