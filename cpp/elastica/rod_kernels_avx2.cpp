#define WITHE_INSTRUCTION_SET avx2
#define WITHE_LANES 4
#include "elastica/rod_kernels_body.hpp"
