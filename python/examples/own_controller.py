# %% [markdown]
# # Write a controller in Python and run it compiled
#
# stickslip converts a Python function to C and to a shared library, and runs it in the loop. The function is recorded
# once, for all samples: use `stickslip.where` for conditions on measurements, `if` for conditions on constants.

# %%
import matplotlib.pyplot as plt

import stickslip
from stickslip import Tunable


@stickslip.controller(
    position_gain=Tunable(20.0, "1/s", minimum=0.0, maximum=1e4, help="Velocity per position deviation."),
    velocity_gain=Tunable(0.08, "N m s/rad", minimum=0.0, maximum=1e3, help="Torque per velocity deviation."),
    integral_gain=Tunable(1.0, "N m/rad", minimum=0.0, maximum=1e4, help="Integral gain of the velocity loop."),
    states={"integral": 0.0},
)
def cascade(p, state, sample, dt):
    """Position loop over a velocity loop; the integral stops at the torque limit."""
    velocity = p.position_gain * (sample.reference_position - sample.measured_angle) + sample.reference_velocity
    deviation = velocity - sample.measured_velocity
    torque = p.velocity_gain * deviation + state.integral
    free = abs(torque) < sample.torque_limit
    state.integral = stickslip.where(free, state.integral + p.integral_gain * deviation * dt, state.integral)
    return stickslip.clip(torque, -sample.torque_limit, sample.torque_limit)


# %% [markdown]
# One step in Python, and the generated C code:

# %%
running = cascade.begin(torque_limit=0.5)
print(running.step(stickslip.Sample(reference_position=0.01)), running.state)
print(cascade.c()["cascade.c"][-1500:])

# %% [markdown]
# The closed loop runs the compiled controller, here with three gains:

# %%
bench = stickslip.preset("clm-bench")
figure, axes = plt.subplots(layout="constrained")
for gain in (10.0, 20.0, 40.0):
    run = stickslip.simulate(bench, "reversal", 3.0, controller=cascade.set(position_gain=gain))
    axes.plot(run["time"], run["reference_position"] - run["true_angle"], label=f"{gain:g} 1/s")
axes.set(xlabel="time [s]", ylabel="deviation [rad]")
axes.legend()

# %%
if __name__ == "__main__":
    print(cascade.build("cascade.so"))
    plt.show()
