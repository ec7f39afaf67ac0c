#include "elastica/rod_kernels.hpp"

namespace withe {

namespace baseline {
extern const RodKernels kRodKernels;
}
#ifdef WITHE_X86_KERNELS
namespace avx2 {
extern const RodKernels kRodKernels;
}
#endif

const RodKernels& rod_kernels() {
#ifdef WITHE_X86_KERNELS
  static const RodKernels& kernels = *pick(&baseline::kRodKernels, &avx2::kRodKernels);
#else
  static const RodKernels& kernels = baseline::kRodKernels;
#endif
  return kernels;
}

}  // namespace withe
