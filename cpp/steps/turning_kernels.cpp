#include "steps/turning_kernels.hpp"

namespace withe {

namespace baseline {
extern const TurningKernels kTurningKernels;
}
#ifdef WITHE_X86_KERNELS
namespace avx2 {
extern const TurningKernels kTurningKernels;
}
#endif

const TurningKernels& turning_kernels() {
#ifdef WITHE_X86_KERNELS
  static const TurningKernels& kernels = *pick(&baseline::kTurningKernels, &avx2::kTurningKernels);
#else
  static const TurningKernels& kernels = baseline::kTurningKernels;
#endif
  return kernels;
}

}  // namespace withe
