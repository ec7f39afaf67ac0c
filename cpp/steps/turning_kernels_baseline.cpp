#define WITHE_INSTRUCTION_SET baseline
#define WITHE_LANES 2
#include "steps/turning_kernels_body.hpp"
