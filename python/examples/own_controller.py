# %% [markdown]
# # A controller of your own, on the target
#
# A function in Python becomes C, a shared library and part of the loop. It is recorded once, for all samples: what
# depends on a measurement is chosen by `stickslip.where`, what is constant by `if`.

# %%
import matplotlib.pyplot as plt

import stickslip
from stickslip import Tunable


@stickslip.controller(
    position_gain=Tunable(20.0, "1/s", minimum=0.0, maximum=1e4, help="Velocity that a deviation asks for."),
    velocity_gain=Tunable(0.08, "N m s/rad", minimum=0.0, maximum=1e3, help="Torque by a deviation of the velocity."),
    integral_gain=Tunable(1.0, "N m/rad", minimum=0.0, maximum=1e4, help="How fast it learns."),
    states={"integral": 0.0},
)
def cascade(p, state, sample, dt):
    """Position over velocity with an integral that stops at the limit of the torque."""
    wanted = p.position_gain * (sample.reference_position - sample.measured_angle) + sample.reference_velocity
    deviation = wanted - sample.measured_velocity
    torque = p.velocity_gain * deviation + state.integral
    free = abs(torque) < sample.torque_limit
    state.integral = stickslip.where(free, state.integral + p.integral_gain * deviation * dt, state.integral)
    return stickslip.clip(torque, -sample.torque_limit, sample.torque_limit)


# %% [markdown]
# One step over floats, for a look inside, and the code of it:

# %%
at_rest = cascade.begin(torque_limit=0.5)
print(at_rest.step(stickslip.Sample(reference_position=0.01)), at_rest.state)
print(cascade.c()["cascade.c"][-1500:])

# %% [markdown]
# In the loop it runs compiled. Another gain is another controller:

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
