#define WITHE_INSTRUCTION_SET baseline
#define WITHE_LANES 2
#include "elasticity/stencil_kernels_body.hpp"
