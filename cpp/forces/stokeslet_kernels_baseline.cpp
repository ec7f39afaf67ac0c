#define WITHE_INSTRUCTION_SET baseline
#define WITHE_LANES 2
#include "forces/stokeslet_kernels_body.hpp"
