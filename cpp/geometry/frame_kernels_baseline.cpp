#define WITHE_INSTRUCTION_SET baseline
#define WITHE_LANES 2
#include "geometry/frame_kernels_body.hpp"
