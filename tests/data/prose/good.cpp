/// True if the rod touches, that is if a gap is below 0.07 mm.
bool touches = false;
constexpr int kPoints[] = {.5, 1'000};  // points of a rule of order 3.5, see file.7z and version v.2

// The tip's distance from the wall. A second sentence follows here, after the first one, so that the whole comment has
// more than thirty-five words. No sentence of it has that many, however, because each sentence ends before it comes to
// so great a length.
double distance = .5;
const char* format = "{:.3f} and then %.5g m";

// A ring keeps nearly all of its speed of 0.2 m/s. Each sentence that ends in a unit of one letter ends here: the force
// that holds the ring on the slope is 3 N. After it the next sentence begins, and has few words.
double force = 3.0;
