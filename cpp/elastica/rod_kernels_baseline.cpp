#define WITHE_INSTRUCTION_SET baseline
#define WITHE_LANES 2
#include "elastica/rod_kernels_body.hpp"
