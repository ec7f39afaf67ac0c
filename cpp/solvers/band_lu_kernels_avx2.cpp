#define WITHE_INSTRUCTION_SET avx2
#define WITHE_LANES 4
#include "solvers/band_lu_kernels_body.hpp"
