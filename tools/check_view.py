"""Try whether pictures can be rendered here, and say in one line what is missing."""

from withe.view.graphics import probe_rendering

try:
    probe_rendering()
except RuntimeError as error:
    print(f"Plots and notebooks work, but 3D pictures do not: {error}")
else:
    print("Pictures, films and notebooks work here.")
