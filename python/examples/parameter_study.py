# %% [markdown]
# # Required accuracy of the friction model
#
# A compensation adds the modelled friction to the command. Here the friction of the machine and that of the model both
# vary from 60 % to 140 % of the preset. The result is the tracking error of a 2 Hz sine.

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
model = {**machine, "name": "model", "path": ["model.own.breakaway_torque", "model.own.kinetic_torque"], "points": 9}
plan = {
    "preset": "prototype",
    "manoeuvres": ["sine_2hz"],
    "set": {"bench.compensation.kind": "feedforward"},
    "axis": [machine, model],
}
results = stickslip.study(plan)
print(results)
results.plot()

# %% [markdown]
# In xarray the axes are dimensions. For each machine: the best model, and the error ratio with the model of the preset.

# %%
deviation = results.to_xarray().sine_2hz_rms
best = deviation.idxmin("model")
ratio = deviation.sel(model=1.0) / deviation.min("model")
for share in deviation.machine.values:
    print(f"machine at {share:.1f}: best model {float(best.sel(machine=share)):.1f}, error with the preset {float(ratio.sel(machine=share)):.1f} times as large")

# %% [markdown]
# A Morris screening shows which parameters matter. It changes one parameter after the other from random start points.

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
