"""
What moves the threshold
========================

How much each parameter of the pad raises or lowers the friction from which it flutters, per per
cent of the parameter.
"""

import matplotlib.pyplot as plt
import numpy as np

import squeal

pad = squeal.Pad(
    m=0.2, w=0.04, h=0.014, k1=2.0e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8, L2=0.8,
    alpha1=0.5 * np.pi, alpha2=np.pi, mu=0.4, F_n=4500.0,
)
scene = squeal.Scene("B1", pad)
first = squeal.thresholds(scene).points[0]
print(f"{first.kind} from mu = {first.mu:.6f}")

# %%
# Exact derivatives of that threshold by every parameter, no differences of repeated runs:

slopes = squeal.sensitivity(scene, of="threshold").slopes
shifts = {name: 1e-2 * slope[0] * getattr(pad, name) / first.mu for name, slope in slopes.items()}
shifts = dict(sorted(shifts.items(), key=lambda item: abs(item[1]))[-10:])

figure, axes = plt.subplots(layout="constrained")
axes.barh(list(shifts), [100.0 * shift for shift in shifts.values()], color="#3498DB")
axes.axvline(0.0, color="k", linewidth=0.8)
axes.set_xlabel("change of the threshold [%] for 1 % of the parameter")
plt.show()

# %%
# A check by repetition: one per cent more height.

taller = squeal.Scene("B1", pad.replace(h=1.01 * pad.h))
moved = squeal.thresholds(taller).points[0].mu / first.mu - 1.0
print(f"h: {100.0 * moved:+.4f} % by repetition, {100.0 * shifts['h']:+.4f} % by derivative")
