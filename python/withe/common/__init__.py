"""Tools for every folder: checks of input, hints, geometry of polylines, recorded frames, extras, progress bars."""
