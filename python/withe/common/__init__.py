"""What every folder uses: checks of user input, geometry of polylines, recorded frames, on-demand packages, the bar."""
