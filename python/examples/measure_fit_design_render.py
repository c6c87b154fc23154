# %% [markdown]
# # Measure, fit, design, render
#
# A positioning axis on the virtual bench: measure and fit its friction, design another friction, render the difference
# with the load motor, and measure again.

# %%
import matplotlib.pyplot as plt
import numpy as np

import stickslip

bench = stickslip.preset("clm-bench")
bench.model.own

# %% [markdown]
# Friction at constant speeds, in both directions.

# %%
curve = stickslip.measure(bench)
fitted = stickslip.fit(curve)
print(fitted)
fitted.plot()

# %% [markdown]
# Desired friction through four points: the same breakaway torque, a faster drop. `renderable` states whether the load
# motor can render it.

# %%
bench = fitted.on(bench)
design = stickslip.design(bench, [(0.1, 0.29), (1.0, 0.21), (5.0, 0.13), (50.0, 0.18)])
print(design)
assert design.renderable

# %%
rendered = stickslip.render(design.preset)
velocity = np.linspace(-50.0, 50.0, 1001)
ax = plt.subplots(layout="constrained")[1]
ax.plot(velocity, design.preset.friction("bench.desired").steady(velocity), label="desired", color="C2")
ax.errorbar(rendered["velocity"], rendered["torque"], 1.96 * rendered["standard_error"], fmt=".", label="rendered")
ax.set_xlabel("velocity [rad/s]")
ax.set_ylabel("torque [N m]")
ax.legend()

# %% [markdown]
# Position control: the same reversal with the own friction and with the rendered friction.

# %%
ax = plt.subplots(layout="constrained")[1]
for render in (False, True):
    run = stickslip.simulate(design.preset, "reversal", render=render)
    deviation = run["reference_position"] - run["true_angle"]
    ax.plot(run["time"], 1e3 * deviation, label="rendered" if render else "own friction")
ax.set_xlabel("time [s]")
ax.set_ylabel("deviation [mrad]")
ax.legend()

# %% [markdown]
# Compare two controllers by the rules of the benchmark.

# %%
ranks = stickslip.benchmark(
    stickslip.preset("prototype"),
    ["cascade", "cascade+feedforward"],
    frictions=["nominal"],
    manoeuvres=["reversal"],
    quick=True,
)
print(ranks)

# %%
if __name__ == "__main__":
    plt.show()
