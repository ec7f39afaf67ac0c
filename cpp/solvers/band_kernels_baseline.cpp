#define WITHE_INSTRUCTION_SET baseline
#define WITHE_LANES 2
#include "solvers/band_kernels_body.hpp"
