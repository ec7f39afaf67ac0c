#define WITHE_INSTRUCTION_SET avx2
#define WITHE_LANES 4
#include "solvers/band_kernels_body.hpp"
