# %% [markdown]
# # Fit a measured friction curve
#
# Two joints of a direct-drive arm, from a CSV file. Joint 1 has a Stribeck drop, joint 2 has none. The points do not
# determine every parameter; the intervals show which ones.

# %%
import matplotlib.pyplot as plt

import stickslip

curves = stickslip.read_curves("../../data/direct_drive_joint/friction_curve.csv", group="joint")
list(curves)

# %%
axes = plt.subplots(1, len(curves), layout="constrained", figsize=(10, 4))[1]
for (name, curve), ax in zip(curves.items(), axes):
    fitted = stickslip.fit(curve)
    print(name, fitted, sep="\n", end="\n\n")
    fitted.plot(ax=ax)
    ax.set_title(name)

# %% [markdown]
# The same fit from arrays: signed velocities, signed torques, and standard errors if available.

# %%
curve = curves["joint 1"]
one_side = stickslip.fit(curve["velocity"], curve["torque"], side="positive")
low, high = one_side.intervals["kinetic_torque"]
print(f"M_K = {one_side.parameters['kinetic_torque']:.2f} N m, between {low:.2f} and {high:.2f}")

# %%
if __name__ == "__main__":
    plt.show()
