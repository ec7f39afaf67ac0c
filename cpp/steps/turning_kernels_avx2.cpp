#define WITHE_INSTRUCTION_SET avx2
#define WITHE_LANES 4
#include "steps/turning_kernels_body.hpp"
