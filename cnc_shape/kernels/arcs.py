# pyright: basic
"""The nearest point of a circular arc, a helix or a spiral, and lengths along them.

An arc is one row of a table (a, 17)::

    0:3    center, the foot of the axis at the arc's start
    3:6    first, unit vector to the start
    6:9    second, unit vector across it, towards the motion
    9:12   normal
    12     radius at the start r0, mm
    13     dr/dphi = g, mm/rad
    14     dz/dphi = h, mm/rad
    15     the whole angle, rad, > 0
    16     length along the path over length by quadrature, about 1

and the curve is ``center + r (cos phi first + sin phi second) + h phi normal`` with ``r = r0 + g phi``.

Seen from a point at radius rho, angle theta and height z about the arc's axis, with psi = phi - theta::

    d^2     = (r - rho)^2 + 4 r rho sin^2(psi/2) + (z - h phi)^2
    d^2' /2 = g (r - rho cos psi) + r rho sin psi - h (z - h phi)
    d^2''/2 = g^2 + h^2 + rho (2 g sin psi + r cos psi)
"""

from math import atan2, ceil, cos, floor, inf, pi, sin, sqrt

from cnc_shape.kernels import kernel

TWO_PI = 2.0 * pi
CORE = pi / 3.0  # rad, half width of the part of a turn that faces the point
NARROW = 1e-7  # rad, a piece not worth halving: d^2 varies by less than r rho NARROW^2 within it
NODE_1, WEIGHT_1 = 0.8611363115940526, 0.3478548451374538  # Gauss-Legendre, four nodes
NODE_2, WEIGHT_2 = 0.3399810435848563, 0.6521451548625461


@kernel
def reach(d_v2):
    """Square of a distance a little above sqrt(d_v2), mm^2: beyond it, no rounding makes anything nearer.

    Coordinates are below 1e6 mm, so distances are rounded by less than 1e-9 mm.
    """
    return (sqrt(d_v2) * (1.0 + 1e-12) + 1e-9) ** 2


@kernel
def quadrature(radius, g, h, angle):
    """Length from the start to `angle`, mm: the integral of sqrt(r^2 + g^2 + h^2) over it."""
    w_v2 = g * g + h * h
    half = 0.5 * g * angle
    middle = radius + half
    return (
        0.5
        * angle
        * (
            WEIGHT_1
            * (sqrt((middle - NODE_1 * half) ** 2 + w_v2) + sqrt((middle + NODE_1 * half) ** 2 + w_v2))
            + WEIGHT_2
            * (sqrt((middle - NODE_2 * half) ** 2 + w_v2) + sqrt((middle + NODE_2 * half) ** 2 + w_v2))
        )
    )


@kernel
def length_at(arcs, j, angle, length):
    """Length from the start of arc j, `length` mm long, to `angle`, mm. arcs (a,17)."""
    if arcs[j, 13] == 0.0:
        return length * (angle / arcs[j, 15])
    return arcs[j, 16] * quadrature(arcs[j, 12], arcs[j, 13], arcs[j, 14], angle)


@kernel
def angle_at(arcs, j, along, length):
    """Angle of arc j, `length` mm long, at `along` mm from its start. arcs (a,17)."""
    radius, g, h, whole = arcs[j, 12], arcs[j, 13], arcs[j, 14], arcs[j, 15]
    angle = whole * (along / length)
    if g == 0.0:
        return angle
    for _ in range(30):
        slope = arcs[j, 16] * sqrt((radius + g * angle) ** 2 + g * g + h * h)
        if slope == 0.0:
            break
        step = (along - arcs[j, 16] * quadrature(radius, g, h, angle)) / slope
        angle = min(max(angle + step, 0.0), whole)
        if abs(step) <= 1e-15 * whole:
            break
    return angle


@kernel
def nearest_turn(low, high):
    """Smallest distance from an angle in [low, high] to a whole turn, in [0, pi] rad."""
    if TWO_PI * ceil(low / TWO_PI) <= high:
        return 0.0
    return min(low - TWO_PI * floor(low / TWO_PI), TWO_PI * ceil(high / TWO_PI) - high)


@kernel
def cosine_range(low, high):
    """Smallest and largest cosine of the angles in [low, high]."""
    return -cos(nearest_turn(low - pi, high - pi)), cos(nearest_turn(low, high))


@kernel
def squared_distance(radius, g, h, rho, theta, z, angle):
    """d^2 of the point (rho, theta, z) to the curve at `angle`, mm^2."""
    r = radius + g * angle
    s = sin(0.5 * (angle - theta))
    return (r - rho) ** 2 + 4.0 * r * rho * s * s + (z - h * angle) ** 2


@kernel
def bound(ra, rb, rho, psi, za, zb):
    """Lower bound of d^2 where r is in [ra, rb], |psi| at least psi, and z - h phi in [za, zb]; unordered."""
    s = sin(0.5 * psi)
    r = min(max(rho * (1.0 - 2.0 * s * s), min(ra, rb)), max(ra, rb))
    rise = max(min(za, zb), -max(za, zb), 0.0)
    return (r - rho) ** 2 + 4.0 * r * rho * s * s + rise * rise


@kernel
def lowest_of_valley(radius, g, h, rho, theta, z, low, high):
    """Angle of the least d^2 in [low, high], where d^2 is convex: Newton, kept in the bracket."""
    angle = min(max(theta + TWO_PI * floor((0.5 * (low + high) - theta) / TWO_PI + 0.5), low), high)
    left, right = low, high
    for _ in range(100):
        psi = angle - theta
        r = radius + g * angle
        s, c = sin(psi), cos(psi)
        slope = g * (r - rho * c) + r * rho * s - h * (z - h * angle)
        if slope > 0.0:
            right = angle
        else:
            left = angle
        if left >= right:  # at an end of the valley, which rises from there
            return angle
        following = angle - slope / (g * g + h * h + rho * (2.0 * g * s + r * c))
        if abs(following - angle) <= 2e-15 * (1.0 + abs(angle)):
            return angle
        if following < left:
            following = low if left == low else 0.5 * (left + right)
        elif following > right:
            following = high if right == high else 0.5 * (left + right)
        angle = following
    return angle


@kernel
def sign_known(radius, g, h, rho, theta, z, low, high):
    """What is certain of d^2 on [low, high]: 1 convex, -1 without a minimum inside, 0 nothing."""
    c_low, c_high = cosine_range(low - theta, high - theta)
    s_low, s_high = cosine_range(low - theta - 0.5 * pi, high - theta - 0.5 * pi)
    ra, rb = radius + g * low, radius + g * high
    r_low, r_high = min(ra, rb), max(ra, rb)
    rs_low = min(r_low * s_low, r_high * s_low)
    rs_high = max(r_low * s_high, r_high * s_high)
    rc_low = min(r_low * c_low, r_high * c_low)
    rc_high = max(r_low * c_high, r_high * c_high)
    gs_low, gs_high = min(g * s_low, g * s_high), max(g * s_low, g * s_high)
    bend = g * g + h * h
    if bend + rho * (2.0 * gs_low + rc_low) > 0.0:
        return 1
    if bend + rho * (2.0 * gs_high + rc_high) < 0.0:
        return -1
    gc_low, gc_high = min(g * c_low, g * c_high), max(g * c_low, g * c_high)
    # g r - h (z - h phi) is linear in phi: its extremes are at the ends
    ends_a = g * ra - h * (z - h * low)
    ends_b = g * rb - h * (z - h * high)
    if (
        min(ends_a, ends_b) + rho * (rs_low - gc_high) > 0.0
        or max(ends_a, ends_b) + rho * (rs_high - gc_low) < 0.0
    ):
        return -1
    return 0


@kernel
def search_piece(radius, g, h, rho, theta, z, low, high, best, best_angle, reach_v2):
    """Improve (best, best_angle) by the interior minima of d^2 in [low, high].

    An interior minimum has d^2' = 0 and d^2'' >= 0. A piece out of reach, or where the slope keeps its
    sign, or where d^2'' < 0, holds none; a piece where d^2'' > 0 holds at most one, and Newton finds it.
    Any other piece is halved. All three certificates are intervals whose width goes with the piece's, so
    only points with slope and curvature both zero are halved down to NARROW, where the middle will do.

    The pieces are the nodes of one binary tree. What is out of reach never includes the least d^2, so
    the node that yields it, and its digits, do not depend on how good a guess the search began with.
    """
    index, parts = 0, 1
    while True:
        a = low + (high - low) * (index / parts)
        b = low + (high - low) * ((index + 1) / parts)
        limit = min(reach_v2, reach(best))
        lower = bound(
            radius + g * a, radius + g * b, rho, nearest_turn(a - theta, b - theta), z - h * a, z - h * b
        )
        if lower <= limit:
            known = sign_known(radius, g, h, rho, theta, z, a, b)
            if known == 0 and b - a > NARROW:
                index *= 2
                parts *= 2
                continue
            if known >= 0:
                angle = 0.5 * (a + b) if known == 0 else lowest_of_valley(radius, g, h, rho, theta, z, a, b)
                d_v2 = squared_distance(radius, g, h, rho, theta, z, angle)
                if d_v2 < best or (d_v2 == best and angle < best_angle):
                    best, best_angle = d_v2, angle
        index += 1
        while index % 2 == 0 and parts > 1:
            index //= 2
            parts //= 2
        if index == parts:
            return best, best_angle


@kernel
def nearest_on_spiral(radius, g, h, rho, theta, z, low, high, reach_v2):
    """(d^2, angle) of the nearest point of a helix or spiral in [low, high]; the smallest angle of equals.

    The least d^2 is at an end or at an interior minimum. Each turn is cut where it turns away from the
    point, |psi| = CORE. Within the core the curvature of d^2 is at least rho (r/2 - sqrt(3) |g|) > 0 for
    every arc but the tightest, so that one Newton search finds its only minimum; what is left of the
    turn is mostly out of reach at once. `search_piece` settles all others.
    """
    best, best_angle = inf, low
    convex = min(radius + g * low, radius + g * high) > 4.0 * abs(g)
    turn_low = ceil((low - theta - CORE) / TWO_PI)
    turn_high = floor((high - theta + CORE) / TWO_PI)
    for turn in range(turn_low, turn_high + 1):
        a = max(low, theta + TWO_PI * turn - CORE)
        b = min(high, theta + TWO_PI * turn + CORE)
        if not a < b:
            continue
        if convex:
            limit = min(reach_v2, reach(best))
            if bound(radius + g * a, radius + g * b, rho, 0.0, z - h * a, z - h * b) <= limit:
                angle = lowest_of_valley(radius, g, h, rho, theta, z, a, b)
                d_v2 = squared_distance(radius, g, h, rho, theta, z, angle)
                if d_v2 < best or (d_v2 == best and angle < best_angle):
                    best, best_angle = d_v2, angle
        else:
            best, best_angle = search_piece(radius, g, h, rho, theta, z, a, b, best, best_angle, reach_v2)
    for end in (low, high):
        away = nearest_turn(end - theta, end - theta) / pi
        limit = min(reach_v2, reach(best))
        r, rise = radius + g * end, z - h * end
        if (r - rho) ** 2 + 4.0 * r * rho * away * away + rise * rise <= limit:  # sin(psi/2) >= psi / pi
            d_v2 = squared_distance(radius, g, h, rho, theta, z, end)
            if d_v2 < best or (d_v2 == best and end < best_angle):
                best, best_angle = d_v2, end
    for turn in range(turn_low - 1, turn_high + 1):
        a = max(low, theta + TWO_PI * turn + CORE)
        b = min(high, theta + TWO_PI * (turn + 1) - CORE)
        if a < b:
            best, best_angle = search_piece(radius, g, h, rho, theta, z, a, b, best, best_angle, reach_v2)
    return best, best_angle


@kernel
def nearest_on_circle(radius, rho, theta, z, low, high):
    """(d^2, angle) of the nearest point of a circle within [low, high], the smallest angle of equals."""
    if rho == 0.0:
        return radius * radius + z * z, low
    facing = theta + TWO_PI * ceil((low - theta) / TWO_PI)
    if facing <= high:
        return (radius - rho) ** 2 + z * z, max(facing, low)
    at_low = squared_distance(radius, 0.0, 0.0, rho, theta, z, low)
    at_high = squared_distance(radius, 0.0, 0.0, rho, theta, z, high)
    return (at_low, low) if at_low <= at_high else (at_high, high)


@kernel
def nearest_on_arc(arcs, j, px, py, pz, low, high, reach_v2):
    """(d^2, angle) of the nearest point of arc j in [low, high]; (inf, low) if out of reach. arcs (a,17)."""
    wx, wy, wz = px - arcs[j, 0], py - arcs[j, 1], pz - arcs[j, 2]
    x = wx * arcs[j, 3] + wy * arcs[j, 4] + wz * arcs[j, 5]
    y = wx * arcs[j, 6] + wy * arcs[j, 7] + wz * arcs[j, 8]
    z = wx * arcs[j, 9] + wy * arcs[j, 10] + wz * arcs[j, 11]
    radius, g, h = arcs[j, 12], arcs[j, 13], arcs[j, 14]
    rho = sqrt(x * x + y * y)
    if bound(radius + g * low, radius + g * high, rho, 0.0, z - h * low, z - h * high) > reach_v2:
        return inf, low
    theta = atan2(y, x)
    if g == 0.0 and h == 0.0:
        return nearest_on_circle(radius, rho, theta, z, low, high)
    return nearest_on_spiral(radius, g, h, rho, theta, z, low, high, reach_v2)
