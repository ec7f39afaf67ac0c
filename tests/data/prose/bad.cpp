/// Whether the rod touches.
bool touches = false;  // a gap of .07 mm counts
int number = 1'000;    ///< likewise

// How far the tip is from the wall, in
// metres.
double distance = .5;

void check(double radius) {
  // Says so where the radius is not positive.
  require(radius > 0, "a radius that is below .1 mm cannot "
                      "be resolved");
}

/* Of the sheet: the greatest curvature that it has anywhere along its length after it has been folded over and before
   the jaw lets it go, where the floor holds it by friction, or by nothing at all if the floor is smooth. */
double curvature = 0.0;
