#define WITHE_INSTRUCTION_SET baseline
#define WITHE_LANES 2
#include "solvers/band_lu_kernels_body.hpp"
