"""Tools for every folder: checks of user input, hints, geometry of polylines, recorded frames, extras, the bar."""
