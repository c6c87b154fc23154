"""Where the well-balanced Strang step (WBS) is stable, found without the product's code.

    pip install numpy==2.4.6 scipy==1.17.1
    python stability.py            # prints what docs/integrator.md quotes; about a minute

Units: the step h is 1 and the load inertia J_L is 1, so that a = sigma_0 h^2/J_L and b = (sigma_1 + viscous) h/J_L.

  region    one stuck mass on an elastic bristle, against the closed form of the Jury conditions
  coupling  the triangle a + 2 b <= 4 with a second mass on a spring, that mass stuck on a bristle of its own or free
  undamped  growth per step where neither bristle nor coupling damps at all
  arm       an elastic arm on the load, kicked in the middle of the step: it counts twice
  sliding   constant speed on the Stribeck curve: instability of the physics stays, none is added
"""

import numpy as np
from scipy.linalg import expm

TW, WM, W, F, Z, FM, ZM, AT, WA = range(9)


def step(a, b, spring=0.0, mass=1e9, damper=0.0, am=0.0, bm=0.0, arm=(0.0, 0.0, 1.0)):
    """The linear map of one step: twist, motor speed, speed, held torque, z, the motor's two, arm twist and speed."""
    n = 9
    A = np.zeros((n, n))
    A[TW, WM], A[TW, W] = 1.0, -1.0
    A[WM, [TW, WM, W]] = np.array([-spring, -damper, damper]) / mass
    A[W, [TW, WM, W]] = spring, damper, -damper
    A[W, F], A[WM, FM] = -1.0, -1.0 / mass
    A[AT, WA], A[AT, W] = 1.0, -1.0
    flow = expm(0.5 * A)
    e = np.eye(n)
    arm_stiffness, arm_damping, arm_mass = arm
    pull = arm_stiffness * e[AT] + arm_damping * (e[WA] - e[W])
    kick = np.eye(n)
    for w, z, held, inertia, stiff, damp, other in ((W, Z, F, 1.0, a, b, pull), (WM, ZM, FM, mass, am * mass, bm * mass, 0.0)):
        predictor = stiff * (e[z] + 0.25 * e[w]) + damp * e[w] - other
        middle = e[w] - 0.5 * (predictor - e[held]) / inertia
        torque = stiff * (e[z] + 0.5 * middle) + damp * middle - other
        kick[w] = e[w] - (torque - e[held]) / inertia
        kick[z] = e[z] + middle
        kick[held] = torque
    kick[WA] = e[WA] - pull / arm_mass
    kicked = kick @ flow
    held_still = kicked.copy()
    held_still[[F, FM]] = flow[[F, FM]]  # both half flows hold the torque of the last step
    out = flow @ held_still
    out[[F, FM, Z, ZM]] = kicked[[F, FM, Z, ZM]]
    return out


def radius(matrix):
    return np.abs(np.linalg.eigvals(matrix)).max()


def stable(a, b):
    """Jury's conditions of the stuck mass; a > 0."""
    cubic = a**3 + 3 * a * a * b - 6 * a * b * b - 8 * b**3 + 32 * b
    return a + 4 * b < 8 and a * (2 - b) < 4 * b * b - 4 * b + 8 and cubic > 0


def region(rng, n=20_000):
    wrong = outside = 0
    for _ in range(n):
        a, b = rng.uniform(0.0, 7.0), rng.uniform(0.0, 2.5)
        rho = radius(step(a, b)[np.ix_([W, F, Z], [W, F, Z])])
        if abs(rho - 1.0) > 1e-9:
            wrong += (rho < 1.0) != stable(a, b)
        outside += a + 2 * b <= 4 and rho > 1.0 + 1e-12
    print(f"region: closed form wrong {wrong} times in {n}; inside a + 2 b <= 4 unstable {outside} times")


def drive(rng, largest, ratio):
    """A random coupling: (h omega)^2 up to `largest`, damping ratio of its free vibration."""
    mass = 10 ** rng.uniform(-2, 2)
    square = largest * rng.uniform()
    spring = square / (1 + 1 / mass)
    return spring, mass, 2 * ratio * np.sqrt(square) / (1 + 1 / mass)


def triangle(rng, least_damping=0.0):
    share, level = rng.uniform(), rng.uniform()
    a, b = 4 * share * level, 2 * (1 - share) * level
    return a, max(b, least_damping * a)


def coupling(rng, n=20_000):
    for largest in (0.25, 1.0, 4.0, 16.0):
        for both in (False, True):
            count = worst = 0
            for _ in range(n):
                am, bm = triangle(rng, 0.02) if both else (0.0, 0.0)
                rho = radius(step(*triangle(rng, 0.02), *drive(rng, largest, 0.0), am, bm))
                # Twice the eigenvalue 1 (the angle is free): rounding splits it by about 1e-8.
                count += rho > 1 + 1e-6
                worst = max(worst, rho - 1)
            stuck = "also stuck" if both else "free"
            print(f"coupling: h omega <= {largest**0.5:.1f}, motor {stuck}: {count} of {n} grow, by {worst:.1e} a step")


def undamped(rng, n=8_000):
    for ratio in (0.0, 1e-3):
        for limit in (0.1, 0.2, 0.5):
            worst = max(radius(step(4 * 10 ** rng.uniform(-3, 0), 0.0, *drive(rng, limit**2, ratio))) - 1 for _ in range(n))
            print(f"undamped: h omega <= {limit}, damping ratio of the coupling {ratio}: growth {worst:.1e} a step")


def with_arm(rng, n=20_000):
    for weight in (1.0, 1.5, 2.0):
        count = 0
        for _ in range(n):
            level, share, split = rng.uniform(), rng.uniform() ** 2, rng.uniform()
            arm_mass = 10 ** rng.uniform(-3, 1.5)
            load = 4 * level * share / weight / (1 + 1 / arm_mass)
            rest, part = 4 * level * (1 - share), rng.uniform()
            a = rest * part
            b = max(rest * (1 - part) / 2, 0.02 * a)
            arm = load * split, load * (1 - split) / 2, arm_mass
            count += radius(step(a, b, *drive(rng, 0.25, 1e-3), arm=arm)) > 1 + 1e-6
        print(f"arm: counted {weight} times: {count} of {n} grow")


class Sliding:
    """The nonlinear step of one mass under the torque that keeps it at a constant speed."""

    def __init__(self, rng):
        self.kinetic = 10 ** rng.uniform(-2, 0)
        self.breakaway = self.kinetic * rng.uniform(1, 2.5)
        self.stribeck = 10 ** rng.uniform(-2, 1)
        self.inertia = 10 ** rng.uniform(-5, -2)
        self.step = 10 ** rng.uniform(-6, -3.5)
        self.viscous = 10 ** rng.uniform(-5, -2) * min(1.0, self.inertia / self.step)
        a, b = triangle(rng)
        level = 10 ** rng.uniform(-2, 0)
        self.stiffness = level * a * self.inertia / self.step**2
        self.damping = level * b * self.inertia / self.step
        self.gaussian, self.elastic = rng.integers(2), rng.integers(2)
        passive = (9.33 if self.gaussian else 8.0) * self.kinetic / self.damping
        self.damping_velocity = min(10 ** rng.uniform(-1, 1), passive)
        self.speed = 10 ** rng.uniform(-3, 2)
        self.torque = self.level(self.speed) + self.viscous * self.speed

    def level(self, w):
        return self.kinetic + (self.breakaway - self.kinetic) * np.exp(-abs(w) / self.stribeck)

    def sigma1(self, w):
        ratio = (w / self.damping_velocity) ** 2
        return self.damping * (np.exp(-ratio) if self.gaussian else 1 / (1 + ratio))

    def alpha(self, z, w):
        slide = self.level(w) / self.stiffness
        zone = min(0.7 * self.breakaway / self.stiffness, 0.95 * slide)
        if not self.elastic or abs(z) >= slide:
            return 1.0
        if z * w <= 0 or abs(z) <= zone:
            return 0.0
        return 0.5 + 0.5 * np.sin(np.pi * (abs(z) - 0.5 * (slide + zone)) / (slide - zone))

    def slope(self, z, w):
        """z times the derivative of alpha, by a central difference; 0 beside the kinks, where alpha is constant."""
        h = 1e-7 * abs(z)
        slide = self.level(w) / self.stiffness
        if abs(z) >= slide or self.alpha(z, w) == 0.0:
            return 0.0
        return z * (self.alpha(z + h, w) - self.alpha(z - h, w)) / (2 * h)

    def advance(self, z, probe, w, h, predicts=False):
        quick = self.stiffness * abs(w) / self.level(w)
        alpha, slope = self.alpha(probe, w), self.slope(probe, w)
        decay = (alpha + slope) * quick
        x = decay * h
        if predicts:
            phi1 = 1 / (1 + x)
            phi2 = 0.5 * phi1
        else:
            phi1 = -np.expm1(-x) / x if x > 1e-6 else 1.0
            phi2 = (1 - phi1) / x if x > 1e-6 else 0.5
        gain = (w + slope * quick * probe - decay * z) * h
        end = z + gain * phi1
        if self.elastic:
            end = np.clip(end, -max(abs(z), self.level(w) / self.stiffness), max(abs(z), self.level(w) / self.stiffness))
        return end, self.stiffness * (z + gain * phi2) + self.sigma1(w) * gain * phi1 / h + self.viscous * w

    def map(self, x):
        w, z, held = x
        h, j = self.step, self.inertia
        w = w + 0.5 * h * (self.torque - held) / j
        probe, predictor = self.advance(z, z, w, 0.5 * h, predicts=True)
        middle = w - 0.5 * (predictor - held) * h / j
        z, torque = self.advance(z, probe, middle, h)
        w = w - (torque - held) * h / j
        return np.array([w + 0.5 * h * (self.torque - held) / j, z, torque])

    def rates(self, x):
        w, z = x
        rate = w - self.alpha(z, w) * self.stiffness * abs(w) * z / self.level(w)
        total = self.stiffness * z + self.sigma1(w) * rate + self.viscous * w
        return np.array([(self.torque - total) / self.inertia, rate])


def differences(f, x):
    columns = [(f(x + e) - f(x - e)) / (2 * e.sum()) for e in np.diag(1e-5 * np.abs(x))]
    return np.array(columns).T


def sliding(rng, n=6_000):
    physical = added = lost = 0
    errors = []
    for _ in range(n):
        case = Sliding(rng)
        at = np.array([case.speed, case.level(case.speed) / case.stiffness, case.torque])
        pole = np.linalg.eigvals(differences(case.rates, at[:2])).real.max()
        rho = radius(differences(case.map, at))
        if pole > 0:
            physical += 1
            lost += rho < 1
            if pole * case.step < 0.05:
                errors.append(abs(np.log(rho) / (pole * case.step) - 1))
        else:
            added += rho > 1 + 1e-6
    print(f"sliding: {n - physical} cases stable in physics, of these {added} grow; {physical} unstable, of these {lost} decay")
    print(f"sliding: growth rate, relative error: median {np.median(errors):.1e}, 90 % below {np.percentile(errors, 90):.1e}")


if __name__ == "__main__":
    for number, study in enumerate((region, coupling, undamped, with_arm, sliding)):
        study(np.random.default_rng(number))
