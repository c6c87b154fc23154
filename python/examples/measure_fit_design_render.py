# %% [markdown]
# # Measure, fit, design, render
#
# A positioning axis on the virtual bench: its friction is measured and fitted, another one is designed, the load motor
# renders the difference, and the friction is measured again.

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
found = stickslip.fit(curve)
print(found)
found.plot()

# %% [markdown]
# A friction with the same breakaway that falls faster, laid through four points. Can the load motor render it?

# %%
bench = found.on(bench)
wanted = stickslip.design(bench, [(0.1, 0.29), (1.0, 0.21), (5.0, 0.13), (50.0, 0.18)])
print(wanted)
assert wanted.renderable

# %%
rendered = stickslip.render(wanted.preset)
velocity = np.linspace(-50.0, 50.0, 1001)
ax = plt.subplots(layout="constrained")[1]
ax.plot(velocity, wanted.preset.friction("bench.desired").steady(velocity), label="desired", color="C2")
ax.errorbar(rendered["velocity"], rendered["torque"], 1.96 * rendered["standard_error"], fmt=".", label="rendered")
ax.set_xlabel("velocity [rad/s]")
ax.set_ylabel("torque [N m]")
ax.legend()

# %% [markdown]
# What a position controller makes of it: the same reversal on the axis as it is, and with the friction rendered.

# %%
ax = plt.subplots(layout="constrained")[1]
for render in (False, True):
    run = stickslip.simulate(wanted.preset, "reversal", render=render)
    deviation = run["reference_position"] - run["true_angle"]
    ax.plot(run["time"], 1e3 * deviation, label="rendered" if render else "own friction")
ax.set_xlabel("time [s]")
ax.set_ylabel("deviation [mrad]")
ax.legend()

# %% [markdown]
# And which of two controllers does better on it, by the rules of the benchmark.

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
