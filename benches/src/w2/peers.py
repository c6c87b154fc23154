"""W1 and W2 by other tools: peers.py numba|jax|scipy VARIANTS SAMPLES.

The problem is that of rk4.c, its file of variants as well. A line on the standard input asks for a run; its seconds of processor time come
back, and with them the largest angle of the first variant. SciPy's line is its relative tolerance.
"""

import os
import sys
import time

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")

import numpy as np

J_M, J_L, STIFFNESS, DAMPING = 8e-4, 1.2e-3, 100.0, 0.01
SIGMA_0, SIGMA_1, M_K, VISCOUS = 5e3, 1.0, 0.2, 2e-3


def rates(exp, absolute, x, torque, drop, stribeck):
    twist, motor, _, velocity, z = x
    coupling = STIFFNESS * twist + DAMPING * (motor - velocity)
    speed = absolute(velocity)
    g = M_K + drop * exp(-speed / stribeck)
    bend = velocity - SIGMA_0 * speed * z / g
    return (
        motor - velocity,
        (torque - coupling) / J_M,
        velocity,
        (coupling - SIGMA_0 * z - SIGMA_1 * bend - VISCOUS * velocity) / J_L,
        bend,
    )


def by_numba(variants, reference):
    import math

    import numba

    @numba.njit(inline="always")
    def inner_rates(x, torque, drop, stribeck):
        twist, motor, _, velocity, z = x
        coupling = STIFFNESS * twist + DAMPING * (motor - velocity)
        speed = abs(velocity)
        g = M_K + drop * math.exp(-speed / stribeck)
        bend = velocity - SIGMA_0 * speed * z / g
        return (
            motor - velocity,
            (torque - coupling) / J_M,
            velocity,
            (coupling - SIGMA_0 * z - SIGMA_1 * bend - VISCOUS * velocity) / J_L,
            bend,
        )

    @numba.njit(inline="always")
    def along(x, h, k):
        return (x[0] + h * k[0], x[1] + h * k[1], x[2] + h * k[2], x[3] + h * k[3], x[4] + h * k[4])

    @numba.njit
    def run(variants, reference, angles):
        for i in range(variants.shape[0]):
            drop, stribeck, gain = variants[i, 0] - M_K, variants[i, 1], variants[i, 2]
            steps = int(variants[i, 3])
            h = 1e-3 / steps
            x = (0.0, 0.0, 0.0, 0.0, 0.0)
            integral = 0.0
            for k in range(reference.shape[0]):
                angles[i, k] = x[2]
                e = gain * (reference[k] - (x[2] + x[0])) - x[1]
                demand = 0.12 * e + integral
                if abs(demand) <= 2.0 or demand * e <= 0.0:
                    integral += 3e-3 * e
                torque = min(max(demand, -2.0), 2.0)
                for _ in range(steps):
                    k1 = inner_rates(x, torque, drop, stribeck)
                    k2 = inner_rates(along(x, 0.5 * h, k1), torque, drop, stribeck)
                    k3 = inner_rates(along(x, 0.5 * h, k2), torque, drop, stribeck)
                    k4 = inner_rates(along(x, h, k3), torque, drop, stribeck)
                    x = along(x, h / 6.0, (
                        k1[0] + 2.0 * (k2[0] + k3[0]) + k4[0],
                        k1[1] + 2.0 * (k2[1] + k3[1]) + k4[1],
                        k1[2] + 2.0 * (k2[2] + k3[2]) + k4[2],
                        k1[3] + 2.0 * (k2[3] + k3[3]) + k4[3],
                        k1[4] + 2.0 * (k2[4] + k3[4]) + k4[4],
                    ))

    angles = np.zeros((len(variants), len(reference)))

    def once(_):
        run(variants, reference, angles)
        return angles[0]

    return once


def by_jax(variants, reference):
    import jax

    jax.config.update("jax_enable_x64", True)
    import jax.numpy as jnp

    steps = int(variants[0, 3])
    h = 1e-3 / steps
    drop, stribeck, gain = (jnp.asarray(variants[:, i]) for i in range(3))
    drop = drop - M_K

    def along(x, h, k):
        return tuple(a + h * b for a, b in zip(x, k))

    def substep(_, both):
        x, torque = both
        f = lambda x: rates(jnp.exp, jnp.abs, x, torque, drop, stribeck)
        k1 = f(x)
        k2 = f(along(x, 0.5 * h, k1))
        k3 = f(along(x, 0.5 * h, k2))
        k4 = f(along(x, h, k3))
        return tuple(a + h / 6.0 * (b + 2.0 * (c + d) + e) for a, b, c, d, e in zip(x, k1, k2, k3, k4)), torque

    def sample(carry, wanted):
        x, integral = carry
        e = gain * (wanted - (x[2] + x[0])) - x[1]
        demand = 0.12 * e + integral
        free = (jnp.abs(demand) <= 2.0) | (demand * e <= 0.0)
        integral = jnp.where(free, integral + 3e-3 * e, integral)
        y, _ = jax.lax.fori_loop(0, steps, substep, (x, jnp.clip(demand, -2.0, 2.0)))
        return (y, integral), x[2]

    zero = jnp.zeros(len(variants))
    run = jax.jit(lambda reference: jax.lax.scan(sample, ((zero,) * 5, zero), reference)[1])
    wanted = jnp.asarray(reference)
    return lambda _: np.asarray(run(wanted).block_until_ready())[:, 0]


def by_scipy(variants, reference):
    import math

    from scipy.integrate import solve_ivp

    drop, stribeck, gain = variants[0, 0] - M_K, variants[0, 1], variants[0, 2]

    def once(line):
        rtol = float(line)
        x, integral, angles = np.zeros(5), 0.0, np.zeros(len(reference))
        for k, wanted in enumerate(reference):
            angles[k] = x[2]
            e = gain * (wanted - (x[2] + x[0])) - x[1]
            demand = 0.12 * e + integral
            if abs(demand) <= 2.0 or demand * e <= 0.0:
                integral += 3e-3 * e
            torque = min(max(demand, -2.0), 2.0)
            f = lambda _, x: rates(math.exp, abs, x, torque, drop, stribeck)
            x = solve_ivp(f, (0.0, 1e-3), x, method="LSODA", rtol=rtol, atol=rtol * 1e-4).y[:, -1]
        return angles

    return once


def main():
    kind, file, samples = sys.argv[1], sys.argv[2], int(sys.argv[3])
    variants = np.fromfile(file).reshape(-1, 4)
    reference = 0.2 * np.sin(2.0 * np.pi * 1e-3 * np.arange(samples))
    once = {"numba": by_numba, "jax": by_jax, "scipy": by_scipy}[kind](variants, reference)
    if kind != "scipy":
        once("")  # compiles
    print("ready", flush=True)
    for line in sys.stdin:
        begin = time.process_time()
        angles = once(line.strip())
        print(time.process_time() - begin, " ".join(repr(float(a)) for a in angles), flush=True)


if __name__ == "__main__":
    main()
