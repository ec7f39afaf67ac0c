#include "solvers/front_kernels.hpp"

namespace withe {

namespace baseline {
extern const FrontKernels kFrontKernels;
}
#ifdef WITHE_X86_KERNELS
namespace avx2 {
extern const FrontKernels kFrontKernels;
}
#endif

const FrontKernels& front_kernels() {
#ifdef WITHE_X86_KERNELS
  static const FrontKernels& kernels = *pick(&baseline::kFrontKernels, &avx2::kFrontKernels);
#else
  static const FrontKernels& kernels = baseline::kFrontKernels;
#endif
  return kernels;
}

}  // namespace withe
