# %% [markdown]
# # How good must the believed friction be?
#
# A compensation subtracts the friction that it believes in. Here the machine's friction and the belief both go from 60 % to
# 140 % of what the preset says, and a sine of 2 Hz tells what is left of it.

# %%
import matplotlib.pyplot as plt
import numpy as np

import stickslip

sliding = "plant.screw_friction.model.lugre.sliding"
machine = {
    "name": "machine",
    "path": [f"{sliding}.breakaway_torque", f"{sliding}.kinetic_torque"],
    "factor": True,
    "range": [0.6, 1.4],
    "points": 5,
}
belief = {**machine, "name": "belief", "path": ["model.own.breakaway_torque", "model.own.kinetic_torque"], "points": 9}
plan = {
    "preset": "prototype",
    "manoeuvres": ["sine_2hz"],
    "set": {"bench.compensation.kind": "feedforward"},
    "axis": [machine, belief],
}
found = stickslip.study(plan)
print(found)
found.plot()

# %% [markdown]
# With xarray the axes are dimensions: the best belief for each machine, and what it costs to believe what the preset says.

# %%
deviation = found.to_xarray().sine_2hz_rms
best = deviation.idxmin("belief")
cost = deviation.sel(belief=1.0) / deviation.min("belief")
for share in deviation.machine.values:
    print(f"machine at {share:.1f}: best belief {float(best.sel(machine=share)):.1f}, without it {float(cost.sel(machine=share)):.1f} times as far off")

# %% [markdown]
# Which of several parameters matter at all? A screening (Morris) changes one after the other from random places.

# %%
screening = stickslip.study(
    {
        "preset": "prototype",
        "manoeuvres": ["sine_2hz"],
        "design": {"kind": "morris", "trajectories": 8},
        "axis": [
            {"name": "breakaway torque", "path": f"{sliding}.breakaway_torque", "range": [0.38, 0.6]},
            {"name": "Stribeck velocity", "path": f"{sliding}.stribeck_velocity", "range": [0.2, 5.0], "logarithmic": True},
            {"name": "inertia", "path": ["plant.drive.load_inertia", "model.drive.load_inertia"], "range": [0.8e-3, 2e-3]},
        ],
    }
)
effects = {record["axis"]: record["magnitude"] for record in screening.summary.records if record["kind"] == "effects"}
figure, ax = plt.subplots(layout="constrained")
ax.barh(list(effects), 1e3 * np.array(list(effects.values())))
ax.set_xlabel("mean change of the deviation over the whole range, mrad")

# %%
if __name__ == "__main__":
    plt.show()
