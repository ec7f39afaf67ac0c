#define WITHE_INSTRUCTION_SET avx2
#define WITHE_LANES 4
#include "elastica/sheet_kernels_body.hpp"
